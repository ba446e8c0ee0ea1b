// Stops that are long enough for the robot to have been carried by a lift or a train. To a camera that sees only the
// cabin, a ride looks like standing still.
#pragma once

#include <cstdint>

#include "storage/graph/graph.h"

namespace relmap::map {

// A shorter stop is no ride, since a robot halts for a moment at any corner.
inline constexpr double kMinRideSeconds = 3;  // without interruption

// Whether the robot stood still for most of the time of an odometry edge.
inline bool stood(const storage::Edge& motion) { return motion.standing_s > motion.driven_s; }

// The odometry edge that leads to the frame of `hot`; nullptr if there is none.
inline const storage::Edge* motion_to(const storage::FrameHot& hot) {
  return !hot.edges.empty() && hot.edges.front().id.ordinal == 0 ? &hot.edges.front() : nullptr;
}

}  // namespace relmap::map
