// Which landmark an observation means: facts are stored (claims, origins), the answer is derived, so that taking a
// closure out is exact.
#pragma once

#include "storage/graph/graph.h"

namespace relmap::storage {

// True for what needs none (tracking, kFromDeletedSession) and for accepted closures.
bool closure_holds(const Graph& graph, ClosureId closure);

// What claims say of a landmark: follows, from it on, the first whose closure is accepted, to a landmark of which no
// claim holds, or one that says that there is no need of it. A claim to what is lost holds no more.
struct Meaning {
  LandmarkId landmark;  // invalid: it is lost
  bool needed = true;
};
Meaning meaning_of(const Graph& graph, LandmarkId landmark);

// The landmark in force: that one. Invalid where there is no need of it.
LandmarkId resolve(const Graph& graph, LandmarkId landmark);

}  // namespace relmap::storage
