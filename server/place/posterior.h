// From likelihoods to probabilities of places and of a new one.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "server/place/inverted_index.h"

namespace relmap::place {

// Prior probability of a new place; the rest is shared evenly by the places of the map (no motion model: a robot may
// wake up anywhere). Cummins and Newman, IJRR 2008, 6. A map of a few places holds less of the world: none of its
// places has more than one of kFewPlaces.
inline constexpr double kNewPlacePrior = 0.9;
inline constexpr std::size_t kFewPlaces = 50;
// L <- kSmoothing L + (1 - kSmoothing) mean(L), the mean under the prior: a single picture leaves at least 1 % of the
// prior to everything else.
inline constexpr double kSmoothing = 0.99;

// Of a query that is thought to be near somewhere, the share of the prior that the places around it have, evenly,
// beside what they have as any others.
inline constexpr double kExpectedPrior = 0.5;

// Each place has `place`, those expected have `expected` beside, a new one has the rest.
struct PlacePriors {
  PlacePriors(std::size_t places, std::size_t places_expected)
      : place((1 - (places_expected > 0 ? kExpectedPrior : 0)) * (1 - kNewPlacePrior) /
              static_cast<double>(std::max(places, kFewPlaces))),
        expected(places_expected > 0 ? kExpectedPrior / static_cast<double>(places_expected) : 0),
        new_place(1 - (places_expected > 0 ? kExpectedPrior : 0) - place * static_cast<double>(places)) {}
  double place, expected, new_place;
};

// What is unknown is taken to look like the places shipped with the vocabulary and like those of the map itself: a mean
// in which all that are shipped, which may be of another world, count as this many places of the map.
inline constexpr double kShippedCount = 30;

// Likelihoods relative to the highest, as sums of integers in steps of 2^-62: they do not depend on the order of
// places. 30 nats below the best (1e-13 of it) a likelihood is 0. Most are; blocks of such places are passed over.
class Posterior {
 public:
  // `scores`: of the query at the map's places. `shipped`: at those shipped with the vocabulary, at least one.
  // `not_unknown`: places of the map, each once, that do not stand for the unknown world. `expected`: those near where
  // the query is thought to be, each once, none left out; or none.
  Posterior(const PlaceScores& scores, std::span<const LogLikelihood> shipped,
            std::span<const std::uint32_t> not_unknown, std::span<const std::uint32_t> expected);

  double new_place() const { return new_place_; }
  double mass(LogLikelihood place) const { return mass(place, prior_); }  // 0 where left out
  double mass_of_expected(LogLikelihood place) const { return mass(place, prior_ + prior_expected_); }
  // Not above any that has at least this mass without being expected. kLeftOut + 1: all may have.
  LogLikelihood lowest_with(double mass) const;

 private:
  double mass(LogLikelihood place, double prior) const;

  LogLikelihood highest_ = kLeftOut;
  std::size_t count_ = 0;

  double new_place_ = 1;
  double prior_ = 0, prior_expected_ = 0, mean_ = 1, floor_ = 0;
};

}  // namespace relmap::place
