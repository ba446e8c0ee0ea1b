// Turns likelihoods into the probabilities of the places of the map and of a new place.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "server/place/inverted_index.h"

namespace relmap::place {

// The prior probability of a new place. The places of the map share the rest evenly; there is no motion model, since a
// robot may wake up anywhere (Cummins and Newman, IJRR 2008, 6). In a map of fewer than kFewPlaces places, which holds
// less of the world, each place has the share that it would have among kFewPlaces.
inline constexpr double kNewPlacePrior = 0.9;
inline constexpr std::size_t kFewPlaces = 50;
// Likelihoods are smoothed: L <- kSmoothing L + (1 - kSmoothing) mean(L), with the mean under the prior. So a single
// picture leaves every place at least 1 % of its prior.
inline constexpr double kSmoothing = 0.99;

// Where a query is expected near a frame, the places around it share this part of the prior evenly, in addition to what
// they have as places of the map.
inline constexpr double kExpectedPrior = 0.5;

// The prior probabilities: `place` for each place, `expected` in addition for each place where the query is expected,
// and `new_place` for a place that the map does not hold.
struct PlacePriors {
  PlacePriors(std::size_t places, std::size_t places_expected)
      : place((1 - (places_expected > 0 ? kExpectedPrior : 0)) * (1 - kNewPlacePrior) /
              static_cast<double>(std::max(places, kFewPlaces))),
        expected(places_expected > 0 ? kExpectedPrior / static_cast<double>(places_expected) : 0),
        new_place(1 - (places_expected > 0 ? kExpectedPrior : 0) - place * static_cast<double>(places)) {}
  double place, expected, new_place;
};

// Unknown places are taken to look like the places shipped with the vocabulary and like those of the map. Their
// likelihood is a mean in which the shipped ones, which may be of another world, together count as this many places of
// the map.
inline constexpr double kShippedCount = 30;

// Sums likelihoods relative to the highest one as integers in steps of 2^-62, so that sums do not depend on the order
// of places. A likelihood 30 nats below the highest (1e-13 of it) counts as 0. That holds for most places; whole blocks
// of them are skipped.
class Posterior {
 public:
  // `scores`: of the query at the map's places. `shipped`: of the query at the places that are shipped with the
  // vocabulary, at least one. `not_unknown`: places of the map that do not stand for the unknown world, each once.
  // `expected`: places near which the query is thought to be, each once and none of them kLeftOut; may be empty.
  Posterior(const PlaceScores& scores, std::span<const LogLikelihood> shipped,
            std::span<const std::uint32_t> not_unknown, std::span<const std::uint32_t> expected);

  double new_place() const { return new_place_; }
  // The posterior of a place with this log-likelihood; 0 for kLeftOut.
  double mass(LogLikelihood place) const { return mass(place, prior_); }
  // The same for a place where the query is expected.
  double mass_of_expected(LogLikelihood place) const { return mass(place, prior_ + prior_expected_); }
  // A lower bound of the log-likelihoods whose mass() is at least `mass`; kLeftOut + 1 if every place may have it.
  LogLikelihood lowest_with(double mass) const;

 private:
  double mass(LogLikelihood place, double prior) const;

  LogLikelihood highest_ = kLeftOut;
  std::size_t count_ = 0;

  double new_place_ = 1;
  double prior_ = 0, prior_expected_ = 0, mean_ = 1, floor_ = 0;
};

}  // namespace relmap::place
