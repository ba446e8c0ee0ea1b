// Frames in memory that two processes share: slots that one of them fills and the other gives back. The receiver makes
// it, of a size that nobody can change any more: a process that has gone mad can spoil pictures in it, and nothing
// else.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "frontend/capture/dc1394/file_handle.h"
#include "proto/base/status.h"

namespace relmap::iidc::dc1394 {

// Thread-safe, but for take(). The memory lives as long as the ring, and that as long as frames are lent.
class FrameRing : public std::enable_shared_from_this<FrameRing> {
 public:
  static constexpr std::size_t kMaxSlots = 256;
  static constexpr std::size_t kMaxBytes = std::size_t{1} << 30;  // together

  // BUDGET_EXCEEDED: no memory for it. INVALID_ARGUMENT: no slots, no bytes, or more than the above.
  static Result<std::shared_ptr<FrameRing>> make(std::size_t slots, std::size_t frame_bytes);
  // The one that was made in another process. INVALID_ARGUMENT: the file is not of this size.
  static Result<std::shared_ptr<FrameRing>> map(FileHandle file, std::size_t slots, std::size_t frame_bytes);
  ~FrameRing();
  FrameRing(const FrameRing&) = delete;
  FrameRing& operator=(const FrameRing&) = delete;

  std::size_t slots() const { return slots_; }
  std::size_t frame_bytes() const { return frame_bytes_; }
  int file() const { return file_.get(); }

  // Of who fills: a free slot, which is not free from now on. Nothing: all are in use.
  std::optional<std::uint32_t> take();
  std::uint8_t* slot(std::uint32_t slot) { return frames_ + slot * stride_; }
  void give_back(std::uint32_t slot);

  // Of who receives: the frame in a slot, which becomes free with the last copy. Null: there is no such slot, or it is
  // lent already.
  std::shared_ptr<const std::uint8_t> lend(std::uint32_t slot);
  bool all_lent() const { return lent_ == slots_; }

 private:
  FrameRing(FileHandle file, std::uint8_t* memory, std::size_t slots, std::size_t frame_bytes);
  std::atomic_ref<std::uint32_t> taken(std::uint32_t slot);

  const FileHandle file_;
  std::uint8_t* const memory_;
  std::uint8_t* const frames_;
  const std::size_t slots_, frame_bytes_, stride_;
  std::uint32_t next_ = 0;  // to be looked at by take()
  std::unique_ptr<std::atomic<bool>[]>
      is_lent_;  // the receiver's own: what is in shared memory anybody may have written
  std::atomic<std::size_t> lent_ = 0;
};

}  // namespace relmap::iidc::dc1394
