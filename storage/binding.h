// Which landmark an observation means: facts are stored (claims, origins), the answer is derived, so that taking a
// closure out is exact.
#pragma once

#include "storage/graph.h"

namespace relmap {

// True for tracking (an invalid id) and for accepted closures.
bool closure_holds(const Graph& graph, ClosureId closure);

// The landmark in force: follows, from `landmark` on, the first claim whose closure is accepted, to its end.
LandmarkId resolve(const Graph& graph, LandmarkId landmark);

}  // namespace relmap
