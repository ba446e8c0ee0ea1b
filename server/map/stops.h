// Where a robot stood still for long enough to have been carried meanwhile, by a lift, a train: to a camera that sees
// the cabin a ride is standing still.
#pragma once

#include <cstdint>

#include "storage/graph/graph.h"

namespace relmap::map {

// A robot halts for a moment at any corner: what is shorter is no ride.
inline constexpr double kMinRideSeconds = 3;  // seconds, in one go

// Along an edge of the robot's own motion, for most of its time.
inline bool stood(const storage::Edge& motion) { return motion.standing_s > motion.driven_s; }

// The motion that led to a frame; nullptr: none did. Of what `graph.hot(frame)` gave.
inline const storage::Edge* motion_to(const storage::FrameHot& hot) {
  return !hot.edges.empty() && hot.edges.front().id.ordinal == 0 ? &hot.edges.front() : nullptr;
}

}  // namespace relmap::map
