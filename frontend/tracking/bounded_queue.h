// A queue of bounded capacity between two threads: the faster one waits.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <utility>

#include "proto/base/mutex.h"

namespace relmap::tracking {

// Thread-safe.
template <typename T>
class BoundedQueue {
 public:
  explicit BoundedQueue(std::size_t capacity) : capacity_(capacity) {}

  // Waits while the queue is full. Returns false, and drops the item, if the queue is cancelled.
  bool push(T item) {
    MutexLock lock(mutex_);
    changed_.wait(mutex_, [&]() RELMAP_REQUIRES(mutex_) { return cancelled_ || items_.size() < capacity_; });
    if (cancelled_) return false;
    items_.push_back(std::move(item));
    changed_.notify_all();
    return true;
  }

  struct Pushed {
    bool taken = false;    // false if the queue is cancelled
    bool dropped = false;  // the oldest item was dropped to make room
  };
  // Does not wait: drops the oldest item if the queue is full.
  Pushed push_dropping_oldest(T item) {
    const MutexLock lock(mutex_);
    if (cancelled_) return {};
    const bool full = items_.size() >= capacity_;
    if (full) items_.pop_front();
    items_.push_back(std::move(item));
    changed_.notify_all();
    return {.taken = true, .dropped = full};
  }

  // Waits for an item. Nothing once the queue is closed and empty, or cancelled.
  std::optional<T> pop() {
    MutexLock lock(mutex_);
    changed_.wait(mutex_, [&]() RELMAP_REQUIRES(mutex_) { return cancelled_ || closed_ || !items_.empty(); });
    if (cancelled_ || items_.empty()) return std::nullopt;
    std::optional<T> item(std::move(items_.front()));
    items_.pop_front();
    changed_.notify_all();
    return item;
  }

  // Nothing more will be pushed. pop() still returns the items that are left.
  void close() {
    const MutexLock lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }

  // Ends all waits at once; the items are lost.
  void cancel() {
    const MutexLock lock(mutex_);
    cancelled_ = true;
    changed_.notify_all();
  }

 private:
  const std::size_t capacity_;
  Mutex mutex_;
  ConditionVariable changed_;
  std::deque<T> items_ RELMAP_GUARDED_BY(mutex_);
  bool closed_ RELMAP_GUARDED_BY(mutex_) = false, cancelled_ RELMAP_GUARDED_BY(mutex_) = false;
};

}  // namespace relmap::tracking
