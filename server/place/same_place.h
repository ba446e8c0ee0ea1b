// Tells whether two frames or two poses are of one place: the same photograph, or the same pose measured twice.
#pragma once

#include <optional>
#include <span>

#include "server/place/map_points.h"
#include "storage/graph/frame_range.h"
#include "storage/graph/graph.h"

namespace relmap::place {

// Whether two poses that were measured independently are the same within 0.5 m and 0.17 rad. `off` is the transform
// between them.
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

// Photographs may have been added to the map twice: as two mono sessions of the same pictures, which no edges join.
// Whether two frames of different mono sessions are of one picture, that is, have the same features. Their indices may
// differ, since photographs may have been added to the folder between the two imports.
bool same_photograph(const storage::Graph& graph, FrameId a, FrameId b);

// Whether any frame in these ranges is of the same photograph as `frame`.
bool has_photograph(const storage::Graph& graph, std::span<const storage::FrameRange> frames, FrameId frame);

}  // namespace relmap::place
