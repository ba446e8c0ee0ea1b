// Recomputes from the stored facts what is derived from them, and says where the map differs: for tests, and for
// whoever verifies a map. From nothing, not step by step as support.h keeps it; and slow: every frame, every path.
#pragma once

#include <string>
#include <vector>

#include "storage/graph/graph.h"

namespace relmap::map {

// One line for each difference: observers, unreached ones, incoming edges, support, active priors, and edges of the
// graph that have neither support nor prior. Empty: all is as it should be.
std::vector<std::string> derived_differences(const storage::Graph& graph);

}  // namespace relmap::map
