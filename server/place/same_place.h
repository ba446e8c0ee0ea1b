// Compares two poses of a picture that were measured independently.
#pragma once

#include <optional>

#include "server/place/map_points.h"

namespace relmap::place {

// Whether two poses are the same within 0.5 m and 0.17 rad. `off` is the transform between them.
inline bool says_the_same(const SE3& off) {
  constexpr double kMetres = 0.5, kRadians = 0.17;
  return off.t.norm() <= kMetres && rotation_angle(off.R) <= kRadians;
}

// T_a_b of two frames of one session that are at most `reach` steps of odometry apart; nullopt if they are not.
inline std::optional<SE3> way_beside(const storage::Graph& graph, FrameId a, FrameId b, std::uint32_t reach) {
  for (const PlacedFrame& placed : along_odometry(graph, a, reach, reach))
    if (placed.frame == b) return placed.T_centre_frame;
  return std::nullopt;
}

}  // namespace relmap::place
