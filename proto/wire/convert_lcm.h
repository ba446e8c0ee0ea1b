// FOR lcm_messages.cc ONLY: the geometry of a pose_t, to and from the types of proto/.
#pragma once

#include "proto/base/status.h"
#include "proto/geometry/geometry.h"
#include "relmap_lcm/pose_t.hpp"

namespace relmap {

void put_pose(const SE3& T_frame_keyframe, const Matrix6& covariance, relmap_lcm::pose_t& message);
struct PoseFromWire {
  SE3 T_frame_keyframe;
  Matrix6 covariance;
};
// NOT_FINITE, BAD_ROTATION, BAD_COVARIANCE.
Result<PoseFromWire> get_pose(const relmap_lcm::pose_t& message);

}  // namespace relmap
