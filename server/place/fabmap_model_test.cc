#include "server/place/fabmap_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "server/place/block_scores.h"
#include "server/place/place_block.h"
#include "server/place/testing/random_vocabulary.h"

namespace relmap::place {
namespace {

// A dense evaluation of FAB-MAP, every word of every place, which shares nothing with the index but the formula's
// inputs.
double dense_log_likelihood(const Vocabulary& v, const std::vector<bool>& query, const std::vector<bool>& place) {
  const double seen[2] = {0.1, 0.5};
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

// The likelihoods by the index at these places, computed by blocks and word by word.
class Indexed {
 public:
  explicit Indexed(const Vocabulary& vocabulary) : model_(vocabulary) {}
  void add(std::vector<std::uint32_t> words) {
    places_.push_back({{1, static_cast<std::uint32_t>(places_.size())}, std::move(words)});
  }
  std::vector<double> log_likelihoods(const std::vector<std::uint32_t>& query,
                                      BlockScores::Counts counts = BlockScores::Counts::kTouched) {
    if (block_.empty()) block_ = encode_place_block(model_, nullptr, places_);
    std::vector<LogLikelihood> values(places_.size());
    scores_.ask(query, counts);
    scores_.of_block(PlaceBlock::parse(block_, model_.size()).or_throw(), values.data());
    std::vector<double> nats;
    for (std::size_t i = 0; i < values.size(); ++i) {
      EXPECT_EQ(values[i], scores_.of_words(model_.place(places_[i].words), places_[i].words));
      nats.push_back(in_nats(values[i]));
    }
    return nats;
  }

  // What words tell the place that the query does not show, although it shows their parents.
  double told_by_parents(const std::vector<std::uint32_t>& query, std::size_t place) const {
    double sum = 0;
    for (const TouchedWord& touched : model_.touched_by(query))
      if (touched.seen == WordCase::kOnlyParent && std::ranges::binary_search(places_[place].words, touched.word))
        sum += in_nats(model_.increment(touched));
    return sum;
  }

 private:
  const FabMapModel model_;
  std::vector<PlaceWords> places_;
  Bytes block_;
  BlockScores scores_{model_};
};

// Compares places and queries from nearly empty to full, and words with bitmaps and with lists.
void expect_as_dense(int queries, std::uint64_t seed) {
  constexpr int kPlaces = 20;
  const auto vocabulary = random_vocabulary(600, 1, seed);
  std::mt19937_64 random(seed + 100);
  Indexed index(*vocabulary);
  std::vector<std::vector<bool>> places;
  for (int i = 0; i < kPlaces; ++i) {
    const auto words = random_words(*vocabulary, 0.01 + 0.04 * i, random);
    index.add(words);
    places.push_back(as_bits(words, vocabulary->size()));
  }
  for (int q = 0; q < queries; ++q) {
    const auto query = random_words(*vocabulary, std::pow(0.8, q % 20), random);
    const auto likelihoods = index.log_likelihoods(query);
    const auto bits = as_bits(query, vocabulary->size());
    const auto i = static_cast<std::size_t>(q % kPlaces);
    ASSERT_NEAR(likelihoods[i], dense_log_likelihood(*vocabulary, bits, places[i]), 1e-8) << "query " << q;
  }
}

TEST(FabMap, IndexedLikelihoodEqualsTheDenseOne) {
  for (const std::uint64_t seed : {1, 2, 3}) expect_as_dense(100, seed);
}

TEST(LongFabMap, IndexedLikelihoodEqualsTheDenseOne) {
  for (const std::uint64_t seed : {4, 5, 6, 7, 8}) expect_as_dense(2000, seed);
}

TEST(FabMap, AScoreMayLeaveOutWordsThatTheQueryDoesNotShow) {
  const auto vocabulary = random_vocabulary(600, 1, 3);
  std::mt19937_64 random(4);
  Indexed index(*vocabulary);
  for (int i = 0; i < 20; ++i) index.add(random_words(*vocabulary, 0.3, random));
  const auto query = random_words(*vocabulary, 0.3, random);
  const auto whole = index.log_likelihoods(query), shown = index.log_likelihoods(query, BlockScores::Counts::kShown);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    const double told = index.told_by_parents(query, i);
    EXPECT_NE(told, 0);
    EXPECT_NEAR(whole[i] - shown[i], told, 1e-8);
  }
}

TEST(FabMap, LikelihoodsOfAllQueriesSumToOne) {
  // p(Z | L) is a distribution over all queries, since f is one over z given zp, and the dependence is a tree.
  const auto vocabulary = random_vocabulary(10, 1, 7);
  Indexed index(*vocabulary);
  index.add({1, 4, 5});
  double sum = 0;
  for (std::uint32_t bits = 0; bits < 1024; ++bits) {
    std::vector<std::uint32_t> query;
    for (std::uint32_t w = 0; w < 10; ++w)
      if (bits >> w & 1) query.push_back(w);
    sum += std::exp(index.log_likelihoods(query)[0]);
  }
  EXPECT_NEAR(sum, 1, 1e-9);
}

TEST(FabMap, AWordSeenInBothSpeaksForThePlace) {
  const DetectorModel detector;
  const double marginal = 0.05, given = 0.05;
  EXPECT_GT(word_likelihood(detector, marginal, given, true, true),
            word_likelihood(detector, marginal, given, true, false));
  EXPECT_LT(word_likelihood(detector, marginal, given, false, true),
            word_likelihood(detector, marginal, given, false, false));
}

}  // namespace
}  // namespace relmap::place
