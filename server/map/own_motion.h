// What a closure says of its robot's own motion: the transform between two keyframes of one session, to be compared
// with the odometry between them (docs/method.md, 7).
#pragma once

#include <cstdint>
#include <optional>

#include "storage/graph/frame.h"

namespace relmap::map {

inline constexpr std::uint32_t kMotionReach = 1000;  // largest difference of index of two keyframes that are compared

// Whether `from` is an earlier keyframe of the session of `to`, near enough to be compared.
inline bool within_motion_reach(FrameId from, FrameId to) {
  return from.session == to.session && from.index < to.index && to.index - from.index <= kMotionReach;
}

// The transform from an earlier frame to the closure's newer end: the closure itself if both of its ends are of one
// session, or the way around that was found with it (way_around.h). Nullopt if it says nothing of the motion.
inline std::optional<storage::WayAround> own_motion(const storage::Edge& closure) {
  if (within_motion_reach(closure.a, closure.b))
    return storage::WayAround{closure.a, closure.prior_T_ab, closure.prior_covariance};
  if (closure.around && within_motion_reach(closure.around->from, closure.b)) return *closure.around;
  return std::nullopt;
}

}  // namespace relmap::map
