// Counts of how long something took, in buckets, for metrics.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace relmap {

// Upper bounds of the buckets in seconds, inclusive: from a small question to the deadline of a call.
inline constexpr std::array kDurationBounds{0.0001, 0.00025, 0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05,
                                            0.1,    0.25,    0.5,    1.0,   2.5,    5.0,   10.0, 30.0,  60.0};

// The bucket that counts a duration.
inline std::size_t duration_bucket(double seconds) {
  return static_cast<std::size_t>(std::lower_bound(kDurationBounds.begin(), kDurationBounds.end(), seconds) -
                                  kDurationBounds.begin());
}

struct DurationCounts {
  std::array<std::uint64_t, kDurationBounds.size() + 1> buckets{};  // the last: longer than all bounds
  double sum_s = 0;

  void add(double seconds) {
    ++buckets[duration_bucket(seconds)];
    sum_s += seconds;
  }
  std::uint64_t total() const {
    std::uint64_t sum = 0;
    for (const std::uint64_t bucket : buckets) sum += bucket;
    return sum;
  }
};

// Thread-safe; nobody waits. Counts of one moment may lack a duration that is being added.
class DurationHistogram {
 public:
  void add(double seconds) {
    buckets_[duration_bucket(seconds)].fetch_add(1, std::memory_order_relaxed);
    sum_ns_.fetch_add(static_cast<std::int64_t>(seconds * 1e9), std::memory_order_relaxed);
  }
  void add(std::chrono::steady_clock::duration took) { add(std::chrono::duration<double>(took).count()); }

  DurationCounts counts() const {
    DurationCounts counts;
    for (std::size_t i = 0; i < buckets_.size(); ++i) counts.buckets[i] = buckets_[i].load(std::memory_order_relaxed);
    counts.sum_s = static_cast<double>(sum_ns_.load(std::memory_order_relaxed)) / 1e9;
    return counts;
  }

 private:
  std::array<std::atomic<std::uint64_t>, kDurationBounds.size() + 1> buckets_{};
  std::atomic<std::int64_t> sum_ns_ = 0;
};

}  // namespace relmap
