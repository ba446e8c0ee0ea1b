#include "server/place/fabmap_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "server/place/inverted_index.h"
#include "server/place/random_vocabulary.h"

namespace relmap {
namespace {

// FAB-MAP as it is written: every word of every place, nothing shared with the index but the formula's inputs.
double dense_log_likelihood(const Vocabulary& v, const std::vector<bool>& query, const std::vector<bool>& place) {
  const double seen[2] = {0.005, 0.39};
  const auto clip = [](double p) { return std::min(std::max(p, 1e-4), 1 - 1e-4); };
  const auto of = [](double p, bool z) { return z ? p : 1 - p; };
  double sum = 0;
  for (std::uint32_t q = 0; q < v.size(); ++q) {
    const bool z = query[q], zp = query[v.parent()[q]], s = place[q];
    const double marginal = clip(v.marginal()[q]);
    const double given = clip(zp ? v.given_parent_present()[q] : v.given_parent_absent()[q]);
    const double weight_present = of(seen[1], s) * marginal, weight_absent = of(seen[0], s) * (1 - marginal);
    double f = 0;
    for (const bool e : {false, true}) {
      const double alpha = of(marginal, z) * of(seen[e], !z) * of(given, !z);
      const double beta = of(marginal, !z) * of(seen[e], z) * of(given, z);
      f += beta / (alpha + beta) * (e ? weight_present : weight_absent) / (weight_present + weight_absent);
    }
    sum += std::log(clip(f));
  }
  return sum;
}

std::vector<std::uint32_t> random_words(const Vocabulary& v, double density, std::mt19937_64& random) {
  std::vector<std::uint32_t> words;
  for (std::uint32_t w = 0; w < v.size(); ++w)
    if (static_cast<double>(random() >> 11) * 0x1p-53 < density) words.push_back(w);
  return words;
}

std::vector<bool> as_bits(const std::vector<std::uint32_t>& words, std::uint32_t size) {
  std::vector<bool> bits(size);
  for (const std::uint32_t w : words) bits[w] = true;
  return bits;
}

TEST(FabMap, IndexedLikelihoodEqualsTheDenseOne) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const auto vocabulary = random_vocabulary(300, 1, seed);
    std::mt19937_64 random(seed + 100);
    const FabMapModel model(*vocabulary);
    InvertedIndex index(model);
    std::vector<std::vector<bool>> places;
    for (int i = 0; i < 40; ++i) {
      const auto words = random_words(*vocabulary, 0.02 + 0.01 * i, random);
      EXPECT_EQ(index.add(words), static_cast<std::uint32_t>(i));
      places.push_back(as_bits(words, vocabulary->size()));
    }
    for (const double density : {0.01, 0.1, 0.5, 1.0}) {
      const auto query = random_words(*vocabulary, density, random);
      const auto touched = model.touched_by(query);
      const std::vector<double> likelihoods = index.log_likelihoods(touched);
      const auto bits = as_bits(query, vocabulary->size());
      ASSERT_EQ(likelihoods.size(), places.size());
      for (std::size_t i = 0; i < places.size(); ++i)
        EXPECT_NEAR(likelihoods[i], dense_log_likelihood(*vocabulary, bits, places[i]), 1e-9);
    }
  }
}

TEST(FabMap, LikelihoodsOfAllQueriesSumToOne) {
  // p(Z | L) is a distribution over what the query may show where f is one over z given zp: tree-structured.
  const auto vocabulary = random_vocabulary(10, 1, 7);
  const FabMapModel model(*vocabulary);
  InvertedIndex index(model);
  index.add(std::vector<std::uint32_t>{1, 4, 5});
  double sum = 0;
  for (std::uint32_t bits = 0; bits < 1024; ++bits) {
    std::vector<std::uint32_t> query;
    for (std::uint32_t w = 0; w < 10; ++w)
      if (bits >> w & 1) query.push_back(w);
    sum += std::exp(index.log_likelihoods(model.touched_by(query))[0]);
  }
  EXPECT_NEAR(sum, 1, 1e-12);
}

TEST(FabMap, AWordSeenInBothSpeaksForThePlace) {
  const DetectorModel detector;
  const double marginal = 0.05, given = 0.05;
  EXPECT_GT(word_likelihood(detector, marginal, given, true, true),
            word_likelihood(detector, marginal, given, true, false));
  EXPECT_LT(word_likelihood(detector, marginal, given, false, true),
            word_likelihood(detector, marginal, given, false, false));
}

TEST(InvertedIndex, CountsItsMemory) {
  const auto vocabulary = random_vocabulary(1000, 1, 8);
  const FabMapModel model(*vocabulary);
  InvertedIndex index(model);
  std::mt19937_64 random(9);
  std::size_t postings = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto words = random_words(*vocabulary, 0.1, random);
    index.add(words);
    postings += words.size();
  }
  const double per_posting = static_cast<double>(index.memory_bytes()) / static_cast<double>(postings);
  EXPECT_GT(per_posting, 4.0);
  EXPECT_LT(per_posting, 6.0) << "lists grow by a quarter";
}

}  // namespace
}  // namespace relmap
