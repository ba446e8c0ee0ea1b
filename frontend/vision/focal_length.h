// The motion of a camera whose focal length nobody knows: a photograph from anywhere against points of the map.
#pragma once

#include <span>

#include "frontend/vision/motion.h"

namespace relmap {

struct MotionAndFocalLength {
  Motion motion;           // its covariance has the focal length's uncertainty in it
  double f = 0;            // pixels
  double sigma_log_f = 0;  // standard deviation of log f
};

// As estimate_motion(), for square pixels and a principal point as `camera` says; its f is not read, and disparities
// are not used. Focal lengths of 0.4 to 4 longer sides are tried; the one that most correspondences agree with is
// refined to the least robust cost over pose and focal length. The covariance is the marginal one: that of the pose at
// this focal length, and what a change of it within its sigma does to the pose. TOO_FEW_INLIERS; NO_CALIBRATION: what
// is seen does not tell the focal length within 35 % (a wall seen from the front shows the same from near with a wide
// lens and from far with a long one).
Result<MotionAndFocalLength> estimate_motion_and_focal_length(std::span<const Correspondence> correspondences,
                                                              const StereoCamera& camera,
                                                              const MotionOptions& options = {});

}  // namespace relmap
