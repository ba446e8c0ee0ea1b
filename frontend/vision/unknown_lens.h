// The motion of a camera that nobody has calibrated: a photograph from anywhere against points of the map.
#pragma once

#include <span>

#include "frontend/vision/lens.h"
#include "frontend/vision/motion.h"

namespace relmap::vision {

struct MotionAndLens {
  Motion motion;  // its covariance has the uncertainty of the lens in it
  Lens lens;
  double sigma_log_f = 0;  // standard deviation of log f
};

// As estimate_motion(), for a camera of which only the picture's size is known: the rest of `camera` is not read, and
// disparities are not used. Focal lengths of 0.4 to 4 longer sides are tried, without distortion and with a wide
// lens's; from what most correspondences agree with, pose and lens are refined together, and more correspondences agree
// as the lens becomes known. What lenses are like is a prior: k1 and k2 move the picture's corners by 0 within 20 % and
// 10 % of their distance from the centre (less where the lens is longer: a corner that is seen under the angle a to the
// middle by 2 % and tan^2(a) / 5), the principal point is the centre within 2 % of the longer side, and pixels are
// square within 0.5 % (one standard deviation each); of the focal length nothing is supposed. The covariance is the
// marginal one, over all lenses. TOO_FEW_INLIERS; NO_CALIBRATION: what is seen does not tell the focal length within
// 35 % (a wall seen from the front shows the same from near with a wide lens and from far with a long one), or it tells
// that the picture was stretched, or is part of a larger one.
Result<MotionAndLens> estimate_motion_and_lens(std::span<const Correspondence> correspondences,
                                               const StereoCamera& camera, const MotionOptions& options = {});

}  // namespace relmap::vision
