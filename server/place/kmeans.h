// k-means over descriptors, seeded by k-means++ (Arthur and Vassilvitskii, SODA 2007). The same input and seed give the
// same answer on every machine.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "server/place/descriptor.h"

namespace relmap::place {

struct KMeans {
  std::vector<Descriptor> centroids;      // at most k: fewer where fewer points differ
  std::vector<std::uint32_t> assignment;  // of each point
};

KMeans kmeans(std::span<const Descriptor> points, std::size_t k, std::uint64_t seed, int iterations = 12);

// Words in two levels: branches, and within each branch words in proportion to its points.
struct WordTree {
  std::vector<Descriptor> branches;
  std::vector<std::uint32_t> branch_begin;  // first word of each branch; the last entry is the number of words
  std::vector<Descriptor> centroids;
};

// At most `words` of them. `progress` is told the share done, 0..1.
WordTree cluster_words(std::span<const Descriptor> points, std::size_t words, std::uint64_t seed,
                       const std::function<void(double)>& progress = {});

}  // namespace relmap::place
