// k-means over descriptors, initialised by k-means++ (Arthur and Vassilvitskii, SODA 2007). The result depends only on
// input and seed, not on the machine.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "server/place/descriptor.h"

namespace relmap::place {

struct KMeans {
  std::vector<Descriptor> centroids;      // k, or fewer if fewer points differ
  std::vector<std::uint32_t> assignment;  // index of each point's centroid
};

KMeans kmeans(std::span<const Descriptor> points, std::size_t k, std::uint64_t seed, int iterations = 12);

// A vocabulary of two levels: branches, and within each branch a number of words in proportion to its points.
struct WordTree {
  std::vector<Descriptor> branches;
  std::vector<std::uint32_t> branch_begin;  // first word of each branch; the last entry is the number of words
  std::vector<Descriptor> centroids;
};

// Makes at most `words` words. `progress` is called with the share done, 0 to 1.
WordTree cluster_words(std::span<const Descriptor> points, std::size_t words, std::uint64_t seed,
                       const std::function<void(double)>& progress = {});

}  // namespace relmap::place
