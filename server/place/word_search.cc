#include "server/place/word_search.h"

#include <algorithm>
#include <array>
#include <limits>

namespace relmap::place {

WordSearch::WordSearch(std::span<const Descriptor> branches, std::span<const std::uint32_t> branch_begin,
                       std::span<const Descriptor> centroids)
    : branches_(branches), branch_begin_(branch_begin), most_(branches.size()) {
  for (std::size_t branch = 0; branch < branches.size(); ++branch) {
    const std::size_t count = branch_begin[branch + 1] - branch_begin[branch];
    words_.emplace_back(centroids.subspan(branch_begin[branch], count));
    most_ = std::max(most_, count);
  }
}

std::uint32_t WordSearch::nearest(const Descriptor& descriptor) const {
  struct Near {
    std::int32_t distance;
    std::uint32_t branch;
  };
  std::array<Near, kBranchesSearched> near;  // ascending
  std::size_t found = 0;
  std::vector<std::int32_t> distances(most_);
  branches_.compare(descriptor, std::span(distances).first(branches_.size()));
  for (std::uint32_t b = 0; b < branches_.size(); ++b) {
    const std::int32_t distance = distances[b];
    if (found == near.size() && distance >= near.back().distance) continue;
    std::size_t i = found < near.size() ? found++ : found - 1;
    for (; i > 0 && distance < near[i - 1].distance; --i) near[i] = near[i - 1];
    near[i] = {distance, b};
  }

  std::uint32_t best = 0;
  auto least = std::numeric_limits<std::int32_t>::max();
  for (std::size_t i = 0; i < found; ++i) {
    const DescriptorTable& words = words_[near[i].branch];
    words.compare(descriptor, std::span(distances).first(words.size()));
    for (std::uint32_t number = 0; number < words.size(); ++number) {
      if (distances[number] >= least) continue;
      least = distances[number];
      best = branch_begin_[near[i].branch] + number;
    }
  }
  return best;
}

}  // namespace relmap::place
