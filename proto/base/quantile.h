// Quantiles of a sample.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace relmap {

// Returns the sample at position share * (n - 1), rounded down, of the n sorted samples: the minimum for share 0, the
// lower median for 0.5, the maximum for 1. 0 if there are no samples. `share` is 0 to 1.
inline double quantile(std::vector<double> samples, double share) {
  if (samples.empty()) return 0;
  const auto at = samples.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(samples.size() - 1));
  std::nth_element(samples.begin(), at, samples.end());
  return *at;
}

}  // namespace relmap
