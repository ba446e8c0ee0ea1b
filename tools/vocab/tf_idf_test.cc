#include "tools/vocab/tf_idf.h"

#include <gtest/gtest.h>

#include <cmath>

#include "server/place/testing/random_vocabulary.h"

namespace relmap::vocab {
namespace {

TEST(TfIdf, IsTheCosineOfCountsTimesLogarithms) {
  place::VocabularyModel model = place::random_vocabulary_model(3, 1, 1);
  model.parent = {0, 0, 0};
  model.marginal = model.given_parent_absent = model.given_parent_present = {0.5F, 0.25F, 0.1F};
  const auto vocabulary = place::Vocabulary::from_bytes(place::encode_vocabulary(model)).or_throw();
  const WeightedWords a = tf_idf(*vocabulary, std::vector<std::uint32_t>{1, 0, 0});
  const WeightedWords b = tf_idf(*vocabulary, std::vector<std::uint32_t>{2, 0});
  const double half = std::log(2), quarter = std::log(4), tenth = std::log(10);
  EXPECT_NEAR(cosine(a, b), 2 * half * half / (std::hypot(2 * half, quarter) * std::hypot(half, tenth)), 1e-6);
  EXPECT_NEAR(cosine(a, a), 1, 1e-12);
}

TEST(TfIdf, NothingIsLikeAPictureWithoutWords) {
  const auto vocabulary = place::random_vocabulary(5, 1, 1);
  EXPECT_EQ(cosine(tf_idf(*vocabulary, {}), tf_idf(*vocabulary, std::vector<std::uint32_t>{1, 2})), 0);
}

}  // namespace
}  // namespace relmap::vocab
