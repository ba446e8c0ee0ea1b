// The digests of a chunk as one record (docs/storage-format.md): an entry of bytes for each frame, so that a commit
// that changes some frames copies the entries of the others.
//
// A digest is kept at the precision that a picture needs. The largest error of
//   a translation     2^-15 (3.1e-5) of its largest component
//   a rotation        2^-15 of its largest component as a quaternion without the largest of the four: 3.1e-5 of the
//                     angle of a small one, and never more than 8e-5 rad
//   variances of motion, seconds driven     2^-8 (0.4 %)
//   numbers of a closure's evidence, its variances     2^-16
// All else is exact. What is stored is a fixed point: encoded again it is the same.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "storage/graph/chunk.h"
#include "storage/graph/digest.h"

namespace relmap::storage {

// The digest as it is after it was stored. `id` is the frame.
FrameDigest as_stored(FrameId id, const FrameDigest& digest);
// Whether two digests as they are stored agree within twice the precision: another processor may have rounded the last
// digit otherwise.
bool agree(const FrameDigest& a, const FrameDigest& b);

class DigestWriter {
 public:
  // `time_us`: any time near those of the frames; entries that are copied must have been written with the same.
  DigestWriter(ChunkId id, std::int64_t time_us) : id_(id), time_us_(time_us) {}
  // Slots must ascend.
  void add(const FrameDigest& digest);
  void copy(std::uint32_t slot, ByteSpan entry, bool closures);
  bool empty() const { return slots_ == 0; }
  Bytes finish() const;

 private:
  ChunkId id_;
  std::int64_t time_us_;
  std::uint64_t slots_ = 0, closures_ = 0;
  ByteWriter entries_;
};

// A record taken apart, with entries that are not decoded. The record's bytes must outlive it.
struct PackedDigests {
  std::int64_t time_us = 0;                         // of DigestWriter
  std::array<ByteSpan, kFramesPerChunk> entries{};  // by slot; empty: no such frame
  std::uint64_t closures = 0;                       // bit by slot: whether the entry has closures

  bool has_closures(std::uint32_t slot) const { return (closures >> slot) & 1; }
};
// TRUNCATED, CORRUPT (also if it is of another chunk than asked for), UNKNOWN_FORMAT_VERSION.
Result<PackedDigests> unpack_digests(ByteSpan record, ChunkId id);

// Decodes a record into `digests`, whose memory is used again: all frames, or those with closures. Reasons as above.
Status decode_digests(ByteSpan record, ChunkId id, ChunkDigest& digests, DigestsOf which = DigestsOf::kAll);

}  // namespace relmap::storage
