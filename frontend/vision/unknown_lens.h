// The pose of an uncalibrated camera: a photograph of unknown origin against points of the map.
#pragma once

#include <span>

#include "frontend/vision/lens.h"
#include "frontend/vision/motion.h"

namespace relmap::vision {

struct MotionAndLens {
  Motion motion;  // its covariance includes the uncertainty of the lens
  Lens lens;
  double sigma_log_f = 0;  // standard deviation of log f
};

// Like estimate_motion(), for a camera of which only the picture's size is known: nothing else of `camera` is read, and
// disparities are not used. It tries focal lengths of 0.4 to 4 times the longer side, without distortion and with that
// of a wide lens. From each of the few with the most inliers, pose and lens are refined together; the number of inliers
// grows as the lens becomes known. What then explains the correspondences best is the answer. The covariance is the
// marginal one of the pose.
//
// The prior of the lens, in standard deviations: k1 moves the picture's corners by a share s of their distance from the
// centre, and k2 by s / 2, where s is 2 % + tan^2(a) / 5, but at most 20 %, for a corner at the angle a from the
// optical axis (long lenses distort less); the principal point is 2 % of the longer side from the centre; pixels are
// square within 0.5 %. The focal length has no prior.
//
// TOO_FEW_INLIERS. NO_CALIBRATION if the focal length cannot be determined within 35 % (a wall seen from the front
// looks the same from near with a wide lens and from far with a long one), or if the picture was stretched or cropped
// off centre.
Result<MotionAndLens> estimate_motion_and_lens(std::span<const Correspondence> correspondences,
                                               const StereoCamera& camera, const MotionOptions& options = {});

}  // namespace relmap::vision
