// Edges whose transform is a guess.
#pragma once

#include "storage/frame.h"

namespace relmap {

// The robot guessed the motion along the edge: no camera saw it (dead reckoning, a gap, a robot that started anew).
inline bool is_guessed(const Edge& edge) {
  return edge.kind == EdgeKind::kPrior || edge.source == MotionSource::kUnsensed;
}

// And no landmark has been seen from both sides since, which would support it.
inline bool is_unmeasured(const Edge& edge) { return is_guessed(edge) && edge.support < kMinSupport; }

}  // namespace relmap
