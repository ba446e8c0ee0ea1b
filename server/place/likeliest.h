// Finds the two places that are likeliest by appearance, and whether one of them stands out.
#pragma once

#include <cstddef>
#include <span>

#include "server/place/place_index.h"
#include "storage/graph/graph.h"

namespace relmap::place {

struct Likeliest {
  std::size_t places = 0;
  double best = 0, other = 0;  // probabilities of the likeliest place and the second likeliest

  bool ambiguous() const { return best < 2 * other; }  // no place stands out
};

// Candidates that are one photograph, added to the map several times, count as one place, with the sum of their
// probabilities.
Likeliest likeliest(const storage::Graph& graph, std::span<const PlaceCandidate> candidates);

}  // namespace relmap::place
