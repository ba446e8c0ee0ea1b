#include "server/place/word_search.h"

#include <algorithm>
#include <limits>

namespace relmap {

std::uint32_t WordSearch::nearest(const Descriptor& descriptor) {
  order_.clear();
  for (std::uint32_t b = 0; b < branches_.size(); ++b)
    order_.emplace_back(squared_distance(descriptor, branches_[b]), b);
  const std::size_t searched = std::min(kBranchesSearched, order_.size());
  std::partial_sort(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(searched), order_.end());

  std::uint32_t best = 0, best_distance = std::numeric_limits<std::uint32_t>::max();
  for (std::size_t i = 0; i < searched; ++i) {
    const std::uint32_t branch = order_[i].second;
    for (std::uint32_t word = branch_begin_[branch]; word < branch_begin_[branch + 1]; ++word) {
      const std::uint32_t distance = squared_distance(descriptor, centroids_[word]);
      if (distance < best_distance) {
        best_distance = distance;
        best = word;
      }
    }
  }
  return best;
}

}  // namespace relmap
