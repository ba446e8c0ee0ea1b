// From likelihoods to probabilities of places and of a new one.
#pragma once

#include <vector>

namespace relmap {

// Prior probability of a new place; the rest is shared evenly by the places of the map (no motion model: a robot may
// wake up anywhere). Cummins and Newman, IJRR 2008, 6.
inline constexpr double kNewPlacePrior = 0.9;
// L <- kSmoothing L + (1 - kSmoothing) mean(L), the mean under the prior: a single picture leaves at least 1 % of the
// prior to everything else.
inline constexpr double kSmoothing = 0.99;

struct Posterior {
  std::vector<double> places;  // 0 where left out
  double new_place = 1;
};

// Log-likelihoods of the query at the map's places, and at places that stand for the unknown world.
Posterior place_posterior(const std::vector<double>& places, const std::vector<bool>& left_out,
                          const std::vector<double>& unknown);

}  // namespace relmap
