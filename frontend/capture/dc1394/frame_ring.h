// Frames in memory that two processes share: one of them fills slots, and the other gives them back. The receiver
// creates the memory with a size that cannot be changed, so a faulty process can only spoil pictures in it.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "frontend/capture/dc1394/file_handle.h"
#include "proto/base/status.h"

namespace relmap::iidc::dc1394 {

// Thread-safe, except for take(). The memory lives as long as the ring, and the ring as long as frames are lent.
class FrameRing : public std::enable_shared_from_this<FrameRing> {
 public:
  static constexpr std::size_t kMaxSlots = 256;
  static constexpr std::size_t kMaxBytes = std::size_t{1} << 30;  // of all slots together

  // Creates a ring. BUDGET_EXCEEDED if there is no memory for it; INVALID_ARGUMENT if slots or bytes are 0, or above
  // the limits.
  static Result<std::shared_ptr<FrameRing>> make(std::size_t slots, std::size_t frame_bytes);
  // Maps a ring that another process created. INVALID_ARGUMENT if the file does not have this size.
  static Result<std::shared_ptr<FrameRing>> map(FileHandle file, std::size_t slots, std::size_t frame_bytes);
  ~FrameRing();
  FrameRing(const FrameRing&) = delete;
  FrameRing& operator=(const FrameRing&) = delete;

  std::size_t slots() const { return slots_; }
  std::size_t frame_bytes() const { return frame_bytes_; }
  int file() const { return file_.get(); }

  // For the sender: takes a free slot. Nothing if all are in use.
  std::optional<std::uint32_t> take();
  std::uint8_t* slot(std::uint32_t slot) { return frames_ + slot * stride_; }
  void give_back(std::uint32_t slot);

  // For the receiver: the frame in a slot, which becomes free with the last copy of the pointer. Null if there is no
  // such slot, or it is lent already.
  std::shared_ptr<const std::uint8_t> lend(std::uint32_t slot);
  bool all_lent() const { return lent_ == slots_; }

 private:
  FrameRing(FileHandle file, std::uint8_t* memory, std::size_t slots, std::size_t frame_bytes);
  std::atomic_ref<std::uint32_t> taken(std::uint32_t slot);

  const FileHandle file_;
  std::uint8_t* const memory_;
  std::uint8_t* const frames_;
  const std::size_t slots_, frame_bytes_, stride_;
  std::uint32_t next_ = 0;  // where take() starts to search
  // The receiver's own record, since the other process can write to shared memory.
  std::unique_ptr<std::atomic<bool>[]> is_lent_;
  std::atomic<std::size_t> lent_ = 0;
};

}  // namespace relmap::iidc::dc1394
