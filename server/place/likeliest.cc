#include "server/place/likeliest.h"

#include <algorithm>
#include <vector>

#include "server/place/same_place.h"

namespace relmap::place {

Likeliest likeliest(const storage::Graph& graph, std::span<const PlaceCandidate> candidates) {
  std::vector<PlaceCandidate> places;
  for (const PlaceCandidate& candidate : candidates) {
    const auto known = std::find_if(places.begin(), places.end(), [&](const PlaceCandidate& place) {
      return same_photograph(graph, candidate.frame, place.frame);
    });
    if (known == places.end())
      places.push_back(candidate);
    else
      known->probability += candidate.probability;
  }
  Likeliest found{places.size()};
  for (const PlaceCandidate& place : places) {
    found.other = std::max(found.other, std::min(found.best, place.probability));
    found.best = std::max(found.best, place.probability);
  }
  return found;
}

}  // namespace relmap::place
