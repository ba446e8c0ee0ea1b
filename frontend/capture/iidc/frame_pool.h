// Memory of frames, used again and again: a stream's transfers fill it, and frames that are read lend it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <new>
#include <vector>

namespace relmap::iidc {

// Thread-safe. Buffers that are lent when the pool goes are freed with their last user.
class FramePool : public std::enable_shared_from_this<FramePool> {
 public:
  using Buffer = std::unique_ptr<std::uint8_t[]>;

  // Nothing: there is no memory for that.
  static std::shared_ptr<FramePool> make(std::size_t buffers, std::size_t bytes) {
    auto pool = std::make_shared<FramePool>();
    for (std::size_t i = 0; i < buffers; ++i) {
      pool->free_.emplace_back(new (std::nothrow) std::uint8_t[bytes]);
      if (!pool->free_.back()) return nullptr;
    }
    return pool;
  }

  // Empty where all are in use.
  Buffer take() {
    const std::lock_guard lock(mutex_);
    if (free_.empty()) return nullptr;
    Buffer buffer = std::move(free_.back());
    free_.pop_back();
    return buffer;
  }
  void give(Buffer buffer) {
    const std::lock_guard lock(mutex_);
    free_.push_back(std::move(buffer));
  }
  // It comes back by itself.
  std::shared_ptr<const std::uint8_t> lend(Buffer buffer) {
    return {buffer.release(), [pool = shared_from_this()](std::uint8_t* bytes) { pool->give(Buffer(bytes)); }};
  }

 private:
  std::mutex mutex_;
  std::vector<Buffer> free_;
};

}  // namespace relmap::iidc
