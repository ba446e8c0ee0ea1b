// Durations of the last few thousand relaxations, for percentiles.
#pragma once

#include <cstddef>
#include <vector>

#include "proto/base/quantile.h"

namespace relmap::map {

class Timings {
 public:
  void add(double seconds) {
    if (microseconds_.size() < kKept)
      microseconds_.push_back(seconds * 1e6);
    else
      microseconds_[next_++ % kKept] = seconds * 1e6;
  }
  // In microseconds, for q in 0..1; 0 if nothing was added.
  double quantile(double q) const { return relmap::quantile(microseconds_, q); }

 private:
  static constexpr std::size_t kKept = 10000;
  std::vector<double> microseconds_;
  std::size_t next_ = 0;
};

}  // namespace relmap::map
