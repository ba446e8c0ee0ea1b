// The tree of words whose distribution is nearest to that of the documents: Chow and Liu, IEEE Trans. Information
// Theory 14(3) 1968: the maximum-weight spanning tree on mutual information.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace relmap::place {

struct ChowLiuTree {
  std::vector<std::uint32_t> parent;  // the root, word 0, is its own
  std::vector<float> marginal;        // p(z = 1)
  std::vector<float> given_parent_absent, given_parent_present;
};

// `documents`: words of each, sorted and unique, all below `words`. Memory: a bit for each word and document; time:
// words^2 x documents / 64. `progress` is told the share done, 0..1.
ChowLiuTree learn_chow_liu(std::span<const std::vector<std::uint32_t>> documents, std::uint32_t words,
                           const std::function<void(double)>& progress = {});

// Mutual information, in nats, of two binary variables: both present in `both` documents of `total`, in `x` and `y` of
// them at all.
double mutual_information(std::size_t both, std::size_t x, std::size_t y, std::size_t total);

}  // namespace relmap::place
