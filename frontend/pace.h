// Releases items at a steady rate.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>

namespace relmap::frontend {

class Pace {
 public:
  // A rate of 0 means no limit.
  explicit Pace(double hz) : hz_(hz), begin_(Clock::now()) {}

  // Waits until the next item is due, or `stop` is set.
  void wait(const std::atomic<bool>& stop) {
    if (hz_ <= 0) return;
    const auto due = begin_ + std::chrono::duration_cast<Clock::duration>(
                                  std::chrono::duration<double>(static_cast<double>(count_++) / hz_));
    while (!stop && Clock::now() < due)
      std::this_thread::sleep_until(std::min(due, Clock::now() + std::chrono::milliseconds(100)));
  }

 private:
  using Clock = std::chrono::steady_clock;
  double hz_;
  Clock::time_point begin_;
  std::uint64_t count_ = 0;
};

}  // namespace relmap::frontend
