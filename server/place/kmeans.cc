#include "server/place/kmeans.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace relmap::place {
namespace {

using Sums = std::array<std::uint64_t, kDescriptorBytes>;

// k-means++: draws each centre with a probability in proportion to the squared distance from the centres before. Stops
// early if every point coincides with a centre.
std::vector<Descriptor> plus_plus(std::span<const Descriptor> points, std::size_t k, std::mt19937_64& random) {
  std::vector<Descriptor> centres{points[random() % points.size()]};
  std::vector<std::uint32_t> distance(points.size(), std::numeric_limits<std::uint32_t>::max());
  while (centres.size() < k) {
    std::uint64_t total = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      distance[i] = std::min(distance[i], squared_distance(points[i], centres.back()));
      total += distance[i];
    }
    if (total == 0) break;
    std::uint64_t draw = random() % total;
    std::size_t chosen = 0;
    while (draw >= distance[chosen]) draw -= distance[chosen++];
    centres.push_back(points[chosen]);
  }
  return centres;
}

// Returns how many points moved to another centroid.
std::size_t assign(std::span<const Descriptor> points, std::span<const Descriptor> centroids,
                   std::vector<std::uint32_t>& assignment) {
  std::size_t moved = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::uint32_t best = 0, best_distance = std::numeric_limits<std::uint32_t>::max();
    for (std::uint32_t c = 0; c < centroids.size(); ++c) {
      const std::uint32_t distance = squared_distance(points[i], centroids[c]);
      if (distance < best_distance) {
        best_distance = distance;
        best = c;
      }
    }
    moved += assignment[i] != best;
    assignment[i] = best;
  }
  return moved;
}

// A centroid that lost all its points stays where it is.
void move_centroids(std::span<const Descriptor> points, std::span<const std::uint32_t> assignment,
                    std::vector<Descriptor>& centroids) {
  std::vector<Sums> sums(centroids.size(), Sums{});
  std::vector<std::uint64_t> counts(centroids.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    Sums& sum = sums[assignment[i]];
    for (std::size_t d = 0; d < kDescriptorBytes; ++d) sum[d] += points[i][d];
    ++counts[assignment[i]];
  }
  for (std::size_t c = 0; c < centroids.size(); ++c)
    if (counts[c] > 0)
      for (std::size_t d = 0; d < kDescriptorBytes; ++d)
        centroids[c][d] = static_cast<std::uint8_t>((sums[c][d] + counts[c] / 2) / counts[c]);
}

// Distributes `words` in proportion to `sizes` (largest remainder method), at least one each.
std::vector<std::size_t> share_out(const std::vector<std::size_t>& sizes, std::size_t words) {
  std::size_t total = 0;
  for (const std::size_t size : sizes) total += size;
  std::vector<std::size_t> shares;
  std::vector<std::pair<double, std::size_t>> remainders;
  std::size_t given = 0;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const double exact = static_cast<double>(words) * static_cast<double>(sizes[i]) / static_cast<double>(total);
    shares.push_back(std::max<std::size_t>(1, static_cast<std::size_t>(exact)));
    given += shares.back();
    remainders.emplace_back(exact - std::floor(exact), i);
  }
  std::sort(remainders.begin(), remainders.end(), std::greater<>());
  for (std::size_t i = 0; given < words && i < remainders.size(); ++i, ++given) ++shares[remainders[i].second];
  return shares;
}

}  // namespace

KMeans kmeans(std::span<const Descriptor> points, std::size_t k, std::uint64_t seed, int iterations) {
  KMeans result;
  if (points.empty() || k == 0) return result;
  std::mt19937_64 random(seed);
  result.centroids = plus_plus(points, k, random);
  result.assignment.assign(points.size(), std::numeric_limits<std::uint32_t>::max());
  for (int i = 0; i < iterations; ++i) {
    if (assign(points, result.centroids, result.assignment) == 0) return result;
    move_centroids(points, result.assignment, result.centroids);
  }
  assign(points, result.centroids, result.assignment);
  return result;
}

WordTree cluster_words(std::span<const Descriptor> points, std::size_t words, std::uint64_t seed,
                       const std::function<void(double)>& progress) {
  const auto branches = static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(words))));
  const KMeans coarse = kmeans(points, std::max<std::size_t>(1, branches), seed);
  std::vector<std::vector<Descriptor>> members(coarse.centroids.size());
  for (std::size_t i = 0; i < points.size(); ++i) members[coarse.assignment[i]].push_back(points[i]);

  WordTree tree;
  std::vector<std::size_t> sizes;
  for (std::size_t b = 0; b < members.size(); ++b) {
    if (members[b].empty()) continue;
    tree.branches.push_back(coarse.centroids[b]);
    sizes.push_back(members[b].size());
  }
  members.erase(std::remove_if(members.begin(), members.end(), [](const auto& m) { return m.empty(); }), members.end());

  const std::vector<std::size_t> shares = share_out(sizes, words);
  for (std::size_t b = 0; b < members.size(); ++b) {
    if (progress) progress(static_cast<double>(b + 1) / static_cast<double>(members.size() + 1));
    tree.branch_begin.push_back(static_cast<std::uint32_t>(tree.centroids.size()));
    const KMeans fine = kmeans(members[b], shares[b], seed + b + 1);
    tree.centroids.insert(tree.centroids.end(), fine.centroids.begin(), fine.centroids.end());
  }
  tree.branch_begin.push_back(static_cast<std::uint32_t>(tree.centroids.size()));
  if (progress) progress(1);
  return tree;
}

}  // namespace relmap::place
