// Which two places does appearance make the likeliest, and does one of them stand out?
#pragma once

#include <cstddef>
#include <span>

#include "server/place/place_index.h"
#include "storage/graph/graph.h"

namespace relmap::place {

struct Likeliest {
  std::size_t places = 0;
  double best = 0, other = 0;  // probabilities of the likeliest, and of the one behind it

  bool ambiguous() const { return best < 2 * other; }  // none stands out
};

// A place that was taken in several times, as photographs, is one, and as likely as all of them together.
Likeliest likeliest(const storage::Graph& graph, std::span<const PlaceCandidate> candidates);

}  // namespace relmap::place
