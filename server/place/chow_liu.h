// Learns the Chow-Liu tree of the words: the tree-shaped distribution that is closest to that of the documents, which
// is the maximum-weight spanning tree on mutual information (Chow and Liu, IEEE Trans. Information Theory 14(3) 1968).
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace relmap::place {

struct ChowLiuTree {
  std::vector<std::uint32_t> parent;  // of each word; the root, word 0, is its own parent
  std::vector<float> marginal;        // p(z = 1)
  std::vector<float> given_parent_absent, given_parent_present;
};

// `documents` holds the words of each document, sorted and unique, all below `words`. Takes memory of one bit for each
// pair of word and document, and time in proportion to words^2 x documents / 64. `progress` is called with the share
// done, 0 to 1.
ChowLiuTree learn_chow_liu(std::span<const std::vector<std::uint32_t>> documents, std::uint32_t words,
                           const std::function<void(double)>& progress = {});

// Mutual information, in nats, of two words: of `total` documents `x` show the first, `y` the second, and `both` show
// both.
double mutual_information(std::size_t both, std::size_t x, std::size_t y, std::size_t total);

}  // namespace relmap::place
