// A pool of frame buffers: transfers of a stream fill them, and frames that are read borrow them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <vector>

#include "proto/base/mutex.h"

namespace relmap::iidc {

// Thread-safe. The pool lives until the last buffer that was lent has been returned.
class FramePool : public std::enable_shared_from_this<FramePool> {
 public:
  using Buffer = std::unique_ptr<std::uint8_t[]>;

  // Null if there is not enough memory.
  static std::shared_ptr<FramePool> make(std::size_t buffers, std::size_t bytes) {
    auto pool = std::make_shared<FramePool>();
    const MutexLock lock(pool->mutex_);
    for (std::size_t i = 0; i < buffers; ++i) {
      pool->free_.emplace_back(new (std::nothrow) std::uint8_t[bytes]);
      if (!pool->free_.back()) return nullptr;
    }
    return pool;
  }

  // Null if all buffers are in use.
  Buffer take() {
    const MutexLock lock(mutex_);
    if (free_.empty()) return nullptr;
    Buffer buffer = std::move(free_.back());
    free_.pop_back();
    return buffer;
  }
  void give(Buffer buffer) {
    const MutexLock lock(mutex_);
    free_.push_back(std::move(buffer));
  }
  // Lends a buffer; it returns to the pool with the last copy of the pointer.
  std::shared_ptr<const std::uint8_t> lend(Buffer buffer) {
    return {buffer.release(), [pool = shared_from_this()](std::uint8_t* bytes) { pool->give(Buffer(bytes)); }};
  }

 private:
  Mutex mutex_;
  std::vector<Buffer> free_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::iidc
