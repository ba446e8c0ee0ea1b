#include "server/place/word_search.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "server/place/testing/random_vocabulary.h"

namespace relmap::place {
namespace {

Descriptor near(const Descriptor& centre, std::mt19937_64& random) {
  Descriptor result;
  for (std::size_t i = 0; i < result.size(); ++i)
    result[i] = static_cast<std::uint8_t>(std::clamp(centre[i] + static_cast<int>(random() % 61) - 30, 0, 255));
  return result;
}

TEST(WordSearch, FindsWhatAnExhaustiveSearchFinds) {
  const VocabularyModel model = random_vocabulary_model(400, 1, 3);
  const WordSearch search(model.branches, model.branch_begin, model.centroids);
  std::mt19937_64 random(4);
  for (int i = 0; i < 500; ++i) {
    const Descriptor query = near(model.centroids[random() % model.centroids.size()], random);
    std::uint32_t nearest = std::numeric_limits<std::uint32_t>::max();
    for (const Descriptor& centroid : model.centroids) nearest = std::min(nearest, squared_distance(query, centroid));
    EXPECT_EQ(squared_distance(query, model.centroids[search.nearest(query)]), nearest);
  }
}

TEST(WordSearch, TakesTheLowestOfEquallyNearWords) {
  std::vector<Descriptor> centroids(4);
  centroids[0].fill(200);
  for (std::size_t i = 1; i < 4; ++i) centroids[i].fill(10);
  const std::vector<Descriptor> branches{centroids[0], centroids[1]};
  const std::vector<std::uint32_t> begin{0, 1, 4};
  Descriptor query;
  query.fill(12);
  EXPECT_EQ(WordSearch(branches, begin, centroids).nearest(query), 1u);
}

TEST(WordSearch, DoesNotOverflowAtTheLargestDistances) {
  std::vector<Descriptor> centroids(2);
  centroids[0].fill(255);
  centroids[1].fill(0);
  const std::vector<Descriptor> branches{centroids[0]};
  const std::vector<std::uint32_t> begin{0, 2};
  const WordSearch search(branches, begin, centroids);
  EXPECT_EQ(search.nearest(centroids[0]), 0u);
  EXPECT_EQ(search.nearest(centroids[1]), 1u);
}

}  // namespace
}  // namespace relmap::place
