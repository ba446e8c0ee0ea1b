// Edges whose transform is a guess.
#pragma once

#include "storage/frame.h"

namespace relmap {

// Nothing measured the motion along the edge: no camera while the robot moved (dead reckoning, a gap, a robot that
// started anew), and no landmark seen from both sides since, which would support it.
inline bool is_unmeasured(const Edge& edge) {
  return (edge.kind == EdgeKind::kPrior || edge.source == MotionSource::kUnsensed) && edge.support < kMinSupport;
}

}  // namespace relmap
