// Checks derived data for tests and for verifying a map: recomputes it from the stored facts and reports where the map
// differs. Unlike support.h, which updates it step by step, this starts from nothing. It is slow: it visits every frame
// and every path.
#pragma once

#include <string>
#include <vector>

#include "storage/graph/graph.h"

namespace relmap::map {

// Returns one line for each difference in observers, unreached observers, incoming edges, support and active priors,
// and for each edge of the graph that has neither support nor prior. Empty if the map is consistent.
std::vector<std::string> derived_differences(const storage::Graph& graph);

}  // namespace relmap::map
