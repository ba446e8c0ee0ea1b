// Mean rate per second over the last ten seconds.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace relmap::intake {

class RateMeter {
 public:
  using Time = std::chrono::steady_clock::time_point;

  void add(Time now, double amount) {
    forget_before(now);
    buckets_[index(now)] += amount;
  }
  double per_second(Time now) {
    forget_before(now);
    double sum = 0;
    for (const double bucket : buckets_) sum += bucket;
    return sum / kSeconds;
  }

 private:
  static constexpr std::int64_t kSeconds = 10;
  static std::int64_t second(Time now) {
    return std::chrono::duration_cast<std::chrono::seconds>(now.time_since_epoch()).count();
  }
  static std::size_t index(Time now) { return static_cast<std::size_t>(second(now) % kSeconds); }

  void forget_before(Time now) {
    const std::int64_t current = second(now);
    if (current - newest_ >= kSeconds) buckets_ = {};
    for (std::int64_t s = newest_ + 1; s <= current && s < newest_ + kSeconds; ++s)
      buckets_[static_cast<std::size_t>(s % kSeconds)] = 0;
    newest_ = current;
  }

  std::array<double, kSeconds> buckets_{};
  std::int64_t newest_ = 0;
};

}  // namespace relmap::intake
