// From where on a loop closure is called suspicious.
#pragma once

namespace relmap {

// Of a suspicion, 0 (nothing speaks against the closure) to 1 (docs/evidence.md). It decides nothing: of the
// closures that join the same stretches of frames a skeleton tells also the most suspicious one if it is at least so
// suspicious, and reports count those that are and name the first.
inline constexpr double kSuspicious = 0.5;

}  // namespace relmap
