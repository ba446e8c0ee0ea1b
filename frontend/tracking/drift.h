// Drift of an odometry chain against truth, as KITTI's odometry benchmark measures it (Geiger et al., CVPR 2012).
#pragma once

#include <cstdint>
#include <span>

#include "proto/geometry/geometry.h"

namespace relmap::tracking {

struct PosePair {
  SE3 truth;     // T_world_camera
  SE3 estimate;  // T_odom_camera, in its own world
};

struct Drift {
  double translation = 0;  // mean over segments: error of the end's position over the length (0.01: 1 %)
  double rotation = 0;     // mean over segments: radians a metre
  std::size_t segments = 0;
};

// Of all segments that are `length` metres of true path long, one from each pose that has one: it ends at the first
// pose at or beyond that length. The world of the estimate plays no part.
Drift measure_drift(std::span<const PosePair> poses, double length);

}  // namespace relmap::tracking
