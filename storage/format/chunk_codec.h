// The container of chunk parts (docs/storage-format.md): a checked header with the index of the frames that follow, and
// a checked record for each, so that one frame can be had without decoding the others. An open chunk's frames stand in
// containers of one.
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
  // `commit`: number of the commit that writes it. `body`: as frame_codec.h encodes it; slots ascending.
  PartWriter(Part part, ChunkId id, std::uint64_t commit) : part_(part), id_(id), commit_(commit) {}
  void add(std::uint32_t slot, ByteSpan body);
  // A record taken over from another container as it is: if it was damaged, it stays so and can be seen to be.
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

// A frame by itself.
Bytes frame_container(Part part, FrameId id, std::uint64_t commit, ByteSpan body);

// A view of the bytes, which must outlive it.
class PartReader {
 public:
  // TRUNCATED, CORRUPT or UNKNOWN_FORMAT_VERSION; CORRUPT also if it is another part or chunk than asked for.
  static Result<PartReader> open(ByteSpan bytes, Part part, ChunkId id, std::uint16_t version = kPartVersion);

  std::uint64_t commit() const { return commit_; }
  std::size_t size() const { return entries_.size(); }
  std::uint32_t slot(std::size_t i) const { return entries_[i].slot; }
  // The i-th body, its checksum verified: CORRUPT.
  Result<ByteSpan> body(std::size_t i) const;
  // As it is stored, and the checksum it should have.
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
