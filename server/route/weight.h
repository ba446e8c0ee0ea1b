// What an edge costs to travel (docs/method.md, 8).
#pragma once

#include "storage/frame.h"

namespace relmap {

enum class RouteBy : std::uint8_t { kDistance = 1, kTime = 2 };

// |t| of the edge, metres.
inline double length_m(const Edge& edge) { return edge.T_ab.t.norm(); }

// Seconds: of an odometry or prior edge the time driven, with `standing` also the time stood; of a loop edge what was
// set when it was accepted.
inline double time_s(const Edge& edge, bool standing) {
  return double{edge.driven_s} + (standing && edge.kind != EdgeKind::kLoop ? double{edge.standing_s} : 0.0);
}

// Loop edges longer than this are flagged: that both ends saw the same thing does not prove that one can drive from one
// to the other (Sibley et al. 2010, 5).
inline constexpr double kLongLoopMetres = 5.0;
inline bool is_long_loop(const Edge& edge) { return edge.kind == EdgeKind::kLoop && length_m(edge) > kLongLoopMetres; }

}  // namespace relmap
