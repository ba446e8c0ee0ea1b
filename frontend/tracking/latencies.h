// Quantiles of durations in constant memory.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace relmap::tracking {

// A histogram that is accurate to 1 % from 10 us to 100 s. Durations outside count as the nearer end. Not thread-safe.
class Latencies {
 public:
  void add(double ms) {
    const double bin = std::log(std::max(ms, kMin) / kMin) / kLogStep;
    ++bins_[std::min(kBins - 1, static_cast<std::size_t>(bin))];
    ++count_;
  }
  std::uint64_t count() const { return count_; }

  // In milliseconds; a share of 0.5 is the median. 0 if there are no durations.
  double quantile(double share) const {
    if (count_ == 0) return 0;
    auto left = static_cast<std::uint64_t>(std::lround(share * static_cast<double>(count_ - 1)));
    std::size_t bin = 0;
    while (bin + 1 < kBins && bins_[bin] <= left) left -= bins_[bin++];
    return kMin * std::exp((static_cast<double>(bin) + 0.5) * kLogStep);
  }

 private:
  static constexpr double kMin = 0.01, kLogStep = 0.02;
  static constexpr std::size_t kBins = 808;  // ln(10^7) / kLogStep
  std::array<std::uint64_t, kBins> bins_{};
  std::uint64_t count_ = 0;
};

}  // namespace relmap::tracking
