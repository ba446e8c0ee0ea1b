// How long things took, in little memory however many there were.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace relmap::tracking {

// Within 1 % from 10 us to 100 s; what lies outside counts as that. Not thread-safe.
class Latencies {
 public:
  void add(double ms) {
    const double bin = std::log(std::max(ms, kMin) / kMin) / kLogStep;
    ++bins_[std::min(kBins - 1, static_cast<std::size_t>(bin))];
    ++count_;
  }
  std::uint64_t count() const { return count_; }

  // Milliseconds; share 0.5: the median. 0 where there are none.
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
