// From likelihoods to probabilities of places and of a new one.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "server/place/inverted_index.h"

namespace relmap {

// Prior probability of a new place; the rest is shared evenly by the places of the map (no motion model: a robot may
// wake up anywhere). Cummins and Newman, IJRR 2008, 6.
inline constexpr double kNewPlacePrior = 0.9;
// L <- kSmoothing L + (1 - kSmoothing) mean(L), the mean under the prior: a single picture leaves at least 1 % of the
// prior to everything else.
inline constexpr double kSmoothing = 0.99;

// Likelihoods relative to the highest, as sums of integers in steps of 2^-62: they do not depend on the order of
// places. 30 nats below the best (1e-13 of it) a likelihood is 0. Most are; blocks of such places are passed over.
class Posterior {
 public:
  // `scores`: of the query at the map's places. `unknown`: at places that stand for the unknown world, at least one.
  Posterior(const PlaceScores& scores, std::vector<LogLikelihood> unknown);

  // Places of the map that stand for the unknown world too.
  void add_unknown(std::span<const LogLikelihood> more);

  double new_place() const { return new_place_; }
  double mass(LogLikelihood place) const;  // 0 where left out
  // Not above any that has at least this mass. kLeftOut + 1: all may have.
  LogLikelihood lowest_with(double mass) const;

 private:
  void normalise();

  LogLikelihood highest_ = kLeftOut;
  std::size_t count_ = 0;
  double sum_of_places_ = 0;
  std::vector<LogLikelihood> unknown_;

  double new_place_ = 1;
  double prior_ = 0, mean_ = 1, floor_ = 0;
};

}  // namespace relmap
