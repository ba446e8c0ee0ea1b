// From where on a loop closure is called suspicious.
#pragma once

namespace relmap {

// Of a suspicion, 0 (nothing speaks against the closure) to 1 (docs/evidence.md). It decides nothing: closures that
// are at least so suspicious are not hidden behind better ones in skeletons of the map, and are named by reports.
inline constexpr double kSuspicious = 0.5;

}  // namespace relmap
