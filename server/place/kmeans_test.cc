#include "server/place/kmeans.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace relmap::place {
namespace {

// `clusters` centres that are far apart, with `each` points close to every one.
std::vector<Descriptor> clustered(std::size_t clusters, std::size_t each, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Descriptor> points;
  for (std::size_t c = 0; c < clusters; ++c) {
    Descriptor centre;
    for (auto& byte : centre) byte = static_cast<std::uint8_t>(10 + random() % 200);
    for (std::size_t i = 0; i < each; ++i) {
      Descriptor point = centre;
      for (auto& byte : point) byte = static_cast<std::uint8_t>(byte + random() % 5);
      points.push_back(point);
    }
  }
  return points;
}

TEST(KMeans, FindsClustersThatAreThere) {
  const auto points = clustered(6, 40, 1);
  const KMeans result = kmeans(points, 6, 2);
  ASSERT_EQ(result.centroids.size(), 6u);
  std::set<std::uint32_t> used;
  for (std::size_t c = 0; c < 6; ++c) {
    used.insert(result.assignment[40 * c]);
    for (std::size_t i = 1; i < 40; ++i) EXPECT_EQ(result.assignment[40 * c + i], result.assignment[40 * c]);
  }
  EXPECT_EQ(used.size(), 6u);
}

TEST(KMeans, EveryPointIsWithItsNearestCentroid) {
  const auto points = clustered(30, 10, 3);
  const KMeans result = kmeans(points, 12, 4);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (const Descriptor& other : result.centroids)
      EXPECT_LE(squared_distance(points[i], result.centroids[result.assignment[i]]),
                squared_distance(points[i], other));
}

TEST(KMeans, MakesNoMoreCentroidsThanPointsDiffer) {
  std::vector<Descriptor> points(20, Descriptor{});
  points[7].fill(9);
  EXPECT_EQ(kmeans(points, 5, 1).centroids.size(), 2u);
  EXPECT_TRUE(kmeans({}, 5, 1).centroids.empty());
}

TEST(ClusterWords, BranchesPartitionTheWords) {
  const auto points = clustered(60, 20, 5);
  const WordTree tree = cluster_words(points, 64, 6);
  EXPECT_EQ(tree.centroids.size(), 64u);
  ASSERT_EQ(tree.branch_begin.size(), tree.branches.size() + 1);
  EXPECT_EQ(tree.branch_begin.front(), 0u);
  EXPECT_EQ(tree.branch_begin.back(), 64u);
  for (std::size_t b = 0; b < tree.branches.size(); ++b) EXPECT_LT(tree.branch_begin[b], tree.branch_begin[b + 1]);
}

TEST(ClusterWords, TheSameSeedGivesTheSameWords) {
  const auto points = clustered(20, 20, 7);
  EXPECT_EQ(cluster_words(points, 30, 8).centroids, cluster_words(points, 30, 8).centroids);
}

}  // namespace
}  // namespace relmap::place
