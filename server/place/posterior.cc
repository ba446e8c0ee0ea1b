#include "server/place/posterior.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace relmap {

Posterior place_posterior(const std::vector<double>& places, const std::vector<bool>& left_out,
                          const std::vector<double>& unknown) {
  Posterior posterior;
  posterior.places.assign(places.size(), 0);
  double highest = -std::numeric_limits<double>::infinity();
  std::size_t count = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (left_out[i]) continue;
    highest = std::max(highest, places[i]);
    ++count;
  }
  if (count == 0) return posterior;
  for (const double value : unknown) highest = std::max(highest, value);

  double new_place = 0;
  for (const double value : unknown) new_place += std::exp(value - highest);
  new_place /= static_cast<double>(unknown.size());
  const double prior = (1 - kNewPlacePrior) / static_cast<double>(count);
  double mean = kNewPlacePrior * new_place;
  for (std::size_t i = 0; i < places.size(); ++i)
    if (!left_out[i]) mean += prior * (posterior.places[i] = std::exp(places[i] - highest));

  // With that mean the smoothed likelihoods, weighted by the prior, sum to the mean again.
  const double floor = (1 - kSmoothing) * mean;
  for (std::size_t i = 0; i < places.size(); ++i)
    if (!left_out[i]) posterior.places[i] = prior * (kSmoothing * posterior.places[i] + floor) / mean;
  posterior.new_place = kNewPlacePrior * (kSmoothing * new_place + floor) / mean;
  return posterior;
}

}  // namespace relmap
