// Quantiles of a sample.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace relmap {

// Returns the sample at position `rank` of the sorted samples, from 0. There must be more than `rank` samples.
template <typename Sample>
Sample ranked(std::vector<Sample> samples, std::size_t rank) {
  const auto at = samples.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(samples.begin(), at, samples.end());
  return *at;
}

// The upper of the two middle samples if their number is even. There must be samples.
template <typename Sample>
Sample upper_median(std::vector<Sample> samples) {
  const std::size_t middle = samples.size() / 2;
  return ranked(std::move(samples), middle);
}

// Returns the sample at position share * (n - 1), rounded down, of the n sorted samples: the minimum for share 0, the
// lower median for 0.5, the maximum for 1. 0 if there are no samples. `share` is 0 to 1.
inline double quantile(std::vector<double> samples, double share) {
  if (samples.empty()) return 0;
  const auto rank = static_cast<std::size_t>(share * static_cast<double>(samples.size() - 1));
  return ranked(std::move(samples), rank);
}

// A sample that is there `weight` times.
struct Weighted {
  double value = 0;
  std::uint64_t weight = 1;
};

// The quantile() of samples that are there several times each, ascending.
inline double weighted_quantile(const std::vector<Weighted>& ascending, double share) {
  std::uint64_t samples = 0;
  for (const Weighted& sample : ascending) samples += sample.weight;
  if (samples == 0) return 0;
  const auto rank = static_cast<std::uint64_t>(share * static_cast<double>(samples - 1));
  std::uint64_t passed = 0;
  for (const Weighted& sample : ascending)
    if ((passed += sample.weight) > rank) return sample.value;
  return ascending.back().value;
}

}  // namespace relmap
