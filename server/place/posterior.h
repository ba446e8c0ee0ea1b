// From likelihoods to probabilities of places and of a new one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "server/place/inverted_index.h"

namespace relmap {

// Prior probability of a new place; the rest is shared evenly by the places of the map (no motion model: a robot may
// wake up anywhere). Cummins and Newman, IJRR 2008, 6. A map of a few places holds less of the world: none of its
// places has more than one of kFewPlaces.
inline constexpr double kNewPlacePrior = 0.9;
inline constexpr std::size_t kFewPlaces = 50;
// L <- kSmoothing L + (1 - kSmoothing) mean(L), the mean under the prior: a single picture leaves at least 1 % of the
// prior to everything else.
inline constexpr double kSmoothing = 0.99;

// What is unknown is taken to look like the places shipped with the vocabulary and like those of the map itself: a mean
// in which all that are shipped, which may be of another world, count as this many places of the map.
inline constexpr double kShippedCount = 30;

// Likelihoods relative to the highest, as sums of integers in steps of 2^-62: they do not depend on the order of
// places. 30 nats below the best (1e-13 of it) a likelihood is 0. Most are; blocks of such places are passed over.
class Posterior {
 public:
  // `scores`: of the query at the map's places. `shipped`: at those shipped with the vocabulary, at least one.
  // `not_unknown`: places of the map, each once, that do not stand for the unknown world.
  Posterior(const PlaceScores& scores, std::span<const LogLikelihood> shipped,
            std::span<const std::uint32_t> not_unknown);

  double new_place() const { return new_place_; }
  double mass(LogLikelihood place) const;  // 0 where left out
  // Not above any that has at least this mass. kLeftOut + 1: all may have.
  LogLikelihood lowest_with(double mass) const;

 private:
  LogLikelihood highest_ = kLeftOut;
  std::size_t count_ = 0;

  double new_place_ = 1;
  double prior_ = 0, mean_ = 1, floor_ = 0;
};

}  // namespace relmap
