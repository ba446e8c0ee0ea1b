#include "server/place/word_search.h"

#include <algorithm>
#include <array>

namespace relmap::place {
namespace {

constexpr std::uint32_t kMaxSquared = kDescriptorBytes * 255 * 255;

}  // namespace

WordSearch::WordSearch(std::span<const Descriptor> branches, std::span<const std::uint32_t> branch_begin,
                       std::span<const Descriptor> centroids)
    : branches_(branches), centroids_(centroids), branch_begin_(branch_begin) {
  std::vector<const Descriptor*> words;
  for (std::size_t branch = 0; branch < branches.size(); ++branch) {
    words.clear();
    for (std::uint32_t word = branch_begin[branch]; word < branch_begin[branch + 1]; ++word)
      words.push_back(&centroids[word]);
    of_words_.emplace_back(words);
  }
}

std::uint32_t WordSearch::nearest(const Descriptor& descriptor) const {
  struct Near {
    std::int32_t distance;
    std::uint32_t branch;
  };
  std::array<Near, kBranchesSearched> near;  // ascending
  std::size_t found = 0;
  std::vector<std::int32_t> distances(branches_.size());
  branches_.compare(descriptor, distances);
  for (std::uint32_t b = 0; b < distances.size(); ++b) {
    const std::int32_t distance = distances[b];
    if (found == near.size() && distance >= near.back().distance) continue;
    std::size_t i = found < near.size() ? found++ : found - 1;
    for (; i > 0 && distance < near[i - 1].distance; --i) near[i] = near[i - 1];
    near[i] = {distance, b};
  }

  const DescriptorSketch sketched = sketch(descriptor);
  std::uint32_t best = 0, max = kMaxSquared;  // the squared distance that a nearer word may have at most
  std::vector<std::uint32_t> possible;
  for (std::size_t i = 0; i < found; ++i) {
    const std::uint32_t branch = near[i].branch;
    possible.clear();
    of_words_[branch].find_near(sketched, max, possible);
    for (const std::uint32_t number : possible) {
      const std::uint32_t word = branch_begin_[branch] + number;
      const std::uint32_t distance = squared_distance(descriptor, centroids_[word]);
      if (distance > max) continue;
      best = word;
      if (distance == 0) return best;
      max = distance - 1;
    }
  }
  return best;
}

}  // namespace relmap::place
