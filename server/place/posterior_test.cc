#include "server/place/posterior.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <unordered_set>
#include <vector>

namespace relmap::place {
namespace {

LogLikelihood nats(double value) { return static_cast<LogLikelihood>(value * kNat); }

// The scores of a query at so many places, of which a few are masked and one may be the right one.
PlaceScores random_scores(std::mt19937& random, std::size_t places) {
  std::normal_distribution<double> likelihood(-400, 6);
  std::bernoulli_distribution masked(0.05), revisit(0.5);
  PlaceScores scores;
  for (std::size_t i = 0; i < places; ++i)
    scores.values.push_back(masked(random) ? kLeftOut : nats(likelihood(random)));
  if (places > 0 && revisit(random)) scores.values[random() % places] = nats(likelihood(random) + 40);
  for (std::size_t begin = 0; begin < places; begin += kPlacesPerBlock) {
    const auto block = scores.of_block(begin / kPlacesPerBlock);
    scores.highest.push_back(*std::max_element(block.begin(), block.end()));
  }
  scores.candidates =
      places - static_cast<std::size_t>(std::count(scores.values.begin(), scores.values.end(), kLeftOut));
  return scores;
}

// The masses of all places of the map and a new one sum to one for any likelihoods and any number of places.
TEST(Posterior, SumsToOne) {
  std::mt19937 random(1);
  for (const std::size_t places : {1, 2, 9, 49, 50, 51, 1000, 4096, 4097, 20000})
    for (int query = 0; query < 20; ++query) {
      const PlaceScores scores = random_scores(random, places);
      if (scores.candidates == 0) continue;
      std::normal_distribution<double> likelihood(-400, 6);
      std::vector<LogLikelihood> shipped(1 + random() % 300);
      for (LogLikelihood& value : shipped) value = nats(likelihood(random));
      std::vector<std::uint32_t> not_unknown, expected;
      for (std::uint32_t place = 0; place < places; ++place) {
        if (random() % 50 == 0) not_unknown.push_back(place);
        if (random() % 50 == 0 && query % 2 == 0 && scores.values[place] != kLeftOut) expected.push_back(place);
      }
      const Posterior posterior(scores, shipped, not_unknown, expected);
      const std::unordered_set<std::uint32_t> is_expected(expected.begin(), expected.end());
      double sum = posterior.new_place();
      for (std::uint32_t place = 0; place < places; ++place) {
        const LogLikelihood value = scores.values[place];
        const double mass = is_expected.contains(place) ? posterior.mass_of_expected(value) : posterior.mass(value);
        EXPECT_GE(mass, 0);
        sum += mass;
      }
      EXPECT_NEAR(sum, 1, 1e-9) << places << " places, " << expected.size() << " of them expected";
    }
}

TEST(Posterior, IsANewPlaceForAMapWithoutPlaces) {
  const Posterior posterior(PlaceScores{}, std::vector<LogLikelihood>{nats(-400)}, {}, {});
  EXPECT_EQ(posterior.new_place(), 1);
  EXPECT_EQ(posterior.mass(nats(-300)), 0);
}

// A place that a search by mass skips has less than that mass.
TEST(Posterior, NoPlaceBelowTheLowestHasTheMass) {
  std::mt19937 random(2);
  for (int query = 0; query < 200; ++query) {
    const PlaceScores scores = random_scores(random, 500);
    const Posterior posterior(scores, std::vector<LogLikelihood>{nats(-400), nats(-395)}, {}, {});
    for (const double mass : {1e-5, 1e-3, 0.1, 0.9}) {
      const LogLikelihood lowest = posterior.lowest_with(mass);
      for (const LogLikelihood value : scores.values) {
        if (posterior.mass(value) >= mass) {
          EXPECT_GE(value, lowest);
        }
      }
    }
  }
}

}  // namespace
}  // namespace relmap::place
