// Quantiles of a sample.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace relmap {

// The sample at `share` (0..1) of the way through the sorted samples, rounded down to a sample: 0 gives the least, 0.5
// the lower median, 1 the greatest. 0 where there are no samples.
inline double quantile(std::vector<double> samples, double share) {
  if (samples.empty()) return 0;
  const auto at = samples.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(samples.size() - 1));
  std::nth_element(samples.begin(), at, samples.end());
  return *at;
}

}  // namespace relmap
