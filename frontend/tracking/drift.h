// Drift of an odometry chain against truth, as KITTI's odometry benchmark measures it (Geiger et al., CVPR 2012).
#pragma once

#include <cstdint>
#include <span>

#include "proto/geometry/geometry.h"

namespace relmap::tracking {

struct PosePair {
  SE3 truth;     // T_world_camera
  SE3 estimate;  // T_odom_camera
};

struct Drift {
  double translation = 0;  // mean over the segments of the error of the end position / length (0.01 is 1 %)
  double rotation = 0;     // mean over the segments, radians per metre
  std::size_t segments = 0;
};

// Measures the drift over all segments of `length` metres of true path. A segment starts at each pose and ends at the
// first pose at or beyond that length; poses too close to the end start none. The two world frames need not agree.
Drift measure_drift(std::span<const PosePair> poses, double length);

}  // namespace relmap::tracking
