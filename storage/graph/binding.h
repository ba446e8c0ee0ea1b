// Which landmark an observation means. Only facts are stored (claims, and origins of observations); the landmark in
// force is derived from them, so that removing a closure undoes exactly what it said.
#pragma once

#include "storage/graph/graph.h"

namespace relmap::storage {

// Whether what `closure` justifies holds: the closure is accepted, or none is needed (an invalid id: tracking, or
// kFromDeletedSession).
bool closure_holds(const Graph& graph, ClosureId closure);

// What the claims of a landmark say. Beginning with `landmark`, the first claim whose closure is accepted is followed
// to its target, until a landmark has no claim that holds, or has one that says it is not needed. A claim does not hold
// if its target is lost.
struct Meaning {
  LandmarkId landmark;  // at the end of the claims; invalid if it is lost
  bool needed = true;
};
Meaning meaning_of(const Graph& graph, LandmarkId landmark);

// The landmark in force that `landmark` stands for. Invalid if it is lost or not needed.
LandmarkId resolve(const Graph& graph, LandmarkId landmark);

}  // namespace relmap::storage
