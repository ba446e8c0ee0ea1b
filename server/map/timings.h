// Durations of the last few thousand relaxations, for percentiles.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace relmap::map {

class Timings {
 public:
  void add(double seconds) {
    if (microseconds_.size() < kKept)
      microseconds_.push_back(seconds * 1e6);
    else
      microseconds_[next_++ % kKept] = seconds * 1e6;
  }
  // q in 0..1; 0 if there are none.
  double quantile(double q) const {
    if (microseconds_.empty()) return 0;
    std::vector<double> sorted = microseconds_;
    const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(sorted.size() - 1));
    std::nth_element(sorted.begin(), at, sorted.end());
    return *at;
  }

 private:
  static constexpr std::size_t kKept = 10000;
  std::vector<double> microseconds_;
  std::size_t next_ = 0;
};

}  // namespace relmap::map
