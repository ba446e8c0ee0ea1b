// One part of a chunk in memory, as it was read: each frame's record is checked and decoded when it is first asked for.
// So a read costs what the disk costs, damage to one frame leaves the others readable, and a commit that changes a few
// frames copies the records of the others.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "proto/base/bytes.h"
#include "proto/base/mutex.h"
#include "proto/base/status.h"
#include "storage/format/chunk_codec.h"
#include "storage/graph/chunk.h"
#include "storage/memory/budget.h"

namespace relmap::storage {

// Thread-safe. Its bytes are charged to Share::kCache for as long as it lives.
template <typename Frame>  // FrameHot or FrameWarm
class PackedPart {
 public:
  // What is stored of a frame. A frame that is not there has neither owner nor damage.
  struct Record {
    std::shared_ptr<const Bytes> owner;  // of the bytes that `body` is part of
    ByteSpan body;
    std::uint32_t crc = 0;
    std::shared_ptr<const Frame> frame;    // if it is decoded already
    std::shared_ptr<const Status> damage;  // set if its container cannot be read

    bool there() const { return owner || damage; }
  };
  using Records = std::array<Record, kFramesPerChunk>;

  PackedPart(std::shared_ptr<Budget> budget, ChunkId id, Records records);
  ~PackedPart();
  PackedPart(const PackedPart&) = delete;
  PackedPart& operator=(const PackedPart&) = delete;

  ChunkId id() const { return id_; }
  // Null if there is no such frame. Throws StatusError: DATA_LOSS naming the frame.
  std::shared_ptr<const Frame> frame(std::uint32_t slot) const;
  // The frames whose bits are set in `slots`.
  Slots<Frame> frames(std::uint64_t slots) const;
  // The record as it is stored, with the frame if that has been decoded.
  Record record(std::uint32_t slot) const;
  bool empty() const;
  // Whether every record matches its checksum.
  bool sound() const;

 private:
  const std::shared_ptr<const Frame>& frame_locked(std::uint32_t slot) const RELMAP_REQUIRES(mutex_);

  const std::shared_ptr<Budget> budget_;
  const ChunkId id_;
  mutable Mutex mutex_;
  mutable Records records_ RELMAP_GUARDED_BY(mutex_);
  mutable std::size_t bytes_ RELMAP_GUARDED_BY(mutex_) = 0;
};

extern template class PackedPart<FrameHot>;
extern template class PackedPart<FrameWarm>;

// Enters the frames of the container `bytes` in `records`, and the commit that wrote it in `commit`. Returns what is
// wrong with the container as a whole, if anything.
template <typename Frame>
Status unpack(std::shared_ptr<const Bytes> bytes, ChunkId id, typename PackedPart<Frame>::Records& records,
              std::uint64_t* commit);

extern template Status unpack<FrameHot>(std::shared_ptr<const Bytes>, ChunkId, PackedPart<FrameHot>::Records&,
                                        std::uint64_t*);
extern template Status unpack<FrameWarm>(std::shared_ptr<const Bytes>, ChunkId, PackedPart<FrameWarm>::Records&,
                                         std::uint64_t*);

// Throws StatusError: DATA_LOSS, "hot part of frame 3:120: ...".
[[noreturn]] void throw_lost(Part part, const std::string& where, const std::string& what);

}  // namespace relmap::storage
