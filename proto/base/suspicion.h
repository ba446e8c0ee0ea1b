// From where on a loop closure is called suspicious.
#pragma once

namespace relmap {

// Of a suspicion, 0 (nothing speaks against the closure) to 1 (docs/evidence.md). It decides nothing: a closure that is
// at least so suspicious is told in every skeleton of the map, and named by reports.
inline constexpr double kSuspicious = 0.5;

}  // namespace relmap
