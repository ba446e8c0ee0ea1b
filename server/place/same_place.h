// Two ways lead to a picture, each measured by itself: do they say the same?
#pragma once

#include <optional>

#include "server/place/map_points.h"

namespace relmap::place {

// `off`: from where the one has it to where the other does.
inline bool says_the_same(const SE3& off) {
  constexpr double kMetres = 0.5, kRadians = 0.17;
  return off.t.norm() <= kMetres && rotation_angle(off.R) <= kRadians;
}

// T_a_b of two frames of one pass, a view apart at most along its odometry (`reach` steps).
inline std::optional<SE3> way_beside(const storage::Graph& graph, FrameId a, FrameId b, std::uint32_t reach) {
  for (const PlacedFrame& placed : along_odometry(graph, a, reach, reach))
    if (placed.frame == b) return placed.T_centre_frame;
  return std::nullopt;
}

}  // namespace relmap::place
