// The container of chunk parts (docs/storage-format.md): a checked header with the index of the frames that follow, and
// a checked record for each frame, so that one frame can be read without decoding the others. Each frame of an open
// chunk has a container of its own.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "storage/graph/chunk.h"

namespace relmap::storage {

inline constexpr std::uint16_t kPartVersion = 2;

class PartWriter {
 public:
  // `commit` is the number of the commit that writes the part. frame_codec.h encodes the bodies; slots must ascend.
  PartWriter(Part part, ChunkId id, std::uint64_t commit) : part_(part), id_(id), commit_(commit) {}
  void add(std::uint32_t slot, ByteSpan body);
  // Copies a record of another container unchanged: a damaged record stays damaged, and readers can tell.
  void copy(std::uint32_t slot, ByteSpan body, std::uint32_t crc);
  Bytes finish() const;

 private:
  struct Entry {
    std::uint8_t slot;
    std::uint32_t length;
    std::uint32_t crc;
  };
  Part part_;
  ChunkId id_;
  std::uint64_t commit_;
  std::vector<Entry> entries_;
  ByteWriter bodies_;
};

// A container with one frame.
Bytes frame_container(Part part, FrameId id, std::uint64_t commit, ByteSpan body);

// Reads a container. The bytes must outlive the reader.
class PartReader {
 public:
  // TRUNCATED, CORRUPT or UNKNOWN_FORMAT_VERSION; CORRUPT also if it is another part or chunk than asked for.
  static Result<PartReader> open(ByteSpan bytes, Part part, ChunkId id, std::uint16_t version = kPartVersion);

  std::uint64_t commit() const { return commit_; }
  std::size_t size() const { return entries_.size(); }
  std::uint32_t slot(std::size_t i) const { return entries_[i].slot; }
  // The i-th body; CORRUPT if it does not match its checksum.
  Result<ByteSpan> body(std::size_t i) const;
  // The i-th body as it is stored, and the checksum that it should have.
  ByteSpan stored(std::size_t i) const { return entries_[i].body; }
  std::uint32_t crc(std::size_t i) const { return entries_[i].crc; }

 private:
  struct Entry {
    std::uint8_t slot;
    std::uint32_t crc;
    ByteSpan body;
  };
  std::uint64_t commit_ = 0;
  std::vector<Entry> entries_;
};

}  // namespace relmap::storage
