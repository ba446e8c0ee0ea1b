// What watchers of a map have heard, all together.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "proto/base/mutex.h"

namespace relmap::bench {

// Thread-safe.
class Heard {
 public:
  void event() { ++events_; }
  // A watcher had all of a commit so many milliseconds after it.
  void commit(double ms) {
    const MutexLock lock(mutex_);
    latencies_ms_.push_back(ms);
  }

  std::uint64_t events() const { return events_; }
  std::vector<double> latencies_ms() const {
    const MutexLock lock(mutex_);
    return latencies_ms_;
  }

 private:
  std::atomic<std::uint64_t> events_{0};
  mutable Mutex mutex_;
  std::vector<double> latencies_ms_ RELMAP_GUARDED_BY(mutex_);
};

// One watcher, who learns of commits.
class HeardByOne {
 public:
  explicit HeardByOne(Heard& heard) : heard_(heard) {}

  void event() { heard_.event(); }
  // All up to `sequence` was told, which was committed at this time. What it is told at first is not new.
  void caught_up(std::uint64_t sequence, std::int64_t time_us, std::int64_t now_us) {
    if (known_ != 0 && sequence > known_) heard_.commit(1e-3 * static_cast<double>(now_us - time_us));
    known_ = sequence;
  }
  bool has_caught_up() const { return known_ != 0; }

 private:
  Heard& heard_;
  std::uint64_t known_ = 0;
};

}  // namespace relmap::bench
