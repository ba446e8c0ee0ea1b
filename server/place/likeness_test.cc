#include "server/place/likeness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace relmap::place {
namespace {

struct Picture {
  std::vector<AppearanceFeature> features;
  std::vector<std::uint32_t> words;
  operator DescribedWords() const { return {features, words}; }
};

// One feature of each word, all with different descriptors.
Picture picture(std::vector<std::uint32_t> words, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Picture result{std::vector<AppearanceFeature>(words.size()), std::move(words)};
  for (AppearanceFeature& feature : result.features)
    for (std::uint8_t& byte : feature.descriptor) byte = static_cast<std::uint8_t>(random() % 90);
  return result;
}

std::vector<double> likeness_of(const Picture& query, const std::vector<DescribedWords>& places,
                                const std::vector<std::uint32_t>& groups) {
  return likeness(query, places, groups);
}

TEST(Likeness, DescriptorsTellPlacesOfTheSameWordsApart) {
  const Picture query = picture({1, 2, 3, 4, 5}, 1), other = picture({1, 2, 3, 4, 5}, 2);
  const auto likes = likeness_of(query, {query, other, picture({6, 7}, 3)}, {0, 1, 2});
  EXPECT_GT(likes[0], 1);
  EXPECT_LT(likes[1], 0);
  EXPECT_LT(likes[2], likes[1]);
}

TEST(Likeness, FeaturesThatManyPlacesShowCountLittle) {
  const Picture query = picture({1, 2, 3, 4}, 1);
  const auto part = [&](std::vector<std::size_t> which) {
    Picture result;
    for (const std::size_t i : which) {
      result.features.push_back(query.features[i]);
      result.words.push_back(query.words[i]);
    }
    return result;
  };
  // The first feature is at every place, the last one only at the last place.
  const Picture common = part({0}), distinct = part({3}), both = part({0, 1});
  const auto likes = likeness_of(query, {common, both, common, common, distinct}, {0, 1, 2, 3, 4});
  EXPECT_GT(likes[4], 0.5);
  EXPECT_GT(likes[1], likes[0]);
  EXPECT_LT(likes[0], 0);
  // Views of one place are no rivals.
  const auto views = likeness_of(query, {distinct, distinct, distinct, common, both}, {0, 0, 0, 1, 2});
  EXPECT_NEAR(views[0], likeness_of(query, {distinct, common, both}, {0, 1, 2})[0], 1e-12);
  EXPECT_EQ(views[0], views[2]);
}

TEST(Likeness, AFeatureOfAPlaceIsMatchedOnce) {
  Picture query = picture({1, 1, 1}, 1);
  query.features[1] = query.features[2] = query.features[0];
  const Picture place = picture({1}, 1);  // the first of them
  ASSERT_EQ(place.features[0].descriptor, query.features[0].descriptor);
  const auto likes = likeness_of(query, {place, picture({2}, 5)}, {0, 1});
  EXPECT_NEAR(likes[0], std::log(3.0 / 2.0), 1e-12);
}

TEST(Likeness, FeaturesThatAllPlacesShowCountForNothing) {
  const Picture query = picture({1, 2, 3, 4}, 1);
  for (const double like : likeness_of(query, {query, query, query}, {0, 1, 2})) EXPECT_NEAR(like, 0, 1e-12);
  EXPECT_EQ(likeness_of(query, {query}, {0})[0], 0) << "of one place nothing can be told";
}

TEST(Likeness, AHigherLikenessHasAHigherLikelihoodRatio) {
  EXPECT_LT(log_likelihood_ratio(0), 0);
  EXPECT_EQ(log_likelihood_ratio(-1), log_likelihood_ratio(0));
  EXPECT_LT(log_likelihood_ratio(4), log_likelihood_ratio(9));
  EXPECT_TRUE(likeness({}, {}, {}).empty());
}

}  // namespace
}  // namespace relmap::place
