#include "server/place/word_search.h"

#include <algorithm>
#include <array>
#include <limits>

namespace relmap::place {
namespace {

// A descriptor as 16-bit numbers, for which the compiler makes multiply-adds of the products with bytes.
using Wide = std::array<std::int16_t, kDescriptorBytes>;

RELMAP_READS_DESCRIPTORS std::int32_t dot(const Wide& a, const Descriptor& b) {
  std::int32_t sum = 0;
  for (std::size_t i = 0; i < kDescriptorBytes; ++i) sum += a[i] * std::int16_t{b[i]};
  return sum;
}

Wide widened(const Descriptor& descriptor) {
  Wide wide;
  std::copy(descriptor.begin(), descriptor.end(), wide.begin());
  return wide;
}

std::vector<std::int32_t> squared_lengths(std::span<const Descriptor> descriptors) {
  std::vector<std::int32_t> result;
  result.reserve(descriptors.size());
  for (const Descriptor& descriptor : descriptors) result.push_back(dot(widened(descriptor), descriptor));
  return result;
}

}  // namespace

WordSearch::WordSearch(std::span<const Descriptor> branches, std::span<const std::uint32_t> branch_begin,
                       std::span<const Descriptor> centroids)
    : branches_{branches, squared_lengths(branches)},
      words_{centroids, squared_lengths(centroids)},
      branch_begin_(branch_begin) {}

std::uint32_t WordSearch::nearest(const Descriptor& descriptor) const {
  const Wide query = widened(descriptor);
  struct Near {
    std::int32_t distance;
    std::uint32_t branch;
  };
  std::array<Near, kBranchesSearched> near;  // ascending
  std::size_t found = 0;
  for (std::uint32_t b = 0; b < branches_.at.size(); ++b) {
    const std::int32_t distance = branches_.squared_length[b] - 2 * dot(query, branches_.at[b]);
    if (found == near.size() && distance >= near.back().distance) continue;
    std::size_t i = found < near.size() ? found++ : found - 1;
    for (; i > 0 && distance < near[i - 1].distance; --i) near[i] = near[i - 1];
    near[i] = {distance, b};
  }

  std::uint32_t best = 0;
  std::int32_t best_distance = std::numeric_limits<std::int32_t>::max();
  for (std::size_t i = 0; i < found; ++i) {
    const std::uint32_t branch = near[i].branch;
    for (std::uint32_t word = branch_begin_[branch]; word < branch_begin_[branch + 1]; ++word) {
      const std::int32_t distance = words_.squared_length[word] - 2 * dot(query, words_.at[word]);
      if (distance < best_distance) {
        best_distance = distance;
        best = word;
      }
    }
  }
  return best;
}

}  // namespace relmap::place
