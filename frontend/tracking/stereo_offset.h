// Estimates the constant error of disparities that the calibration has left. If one eye turns by a hundredth of a
// degree, as after a warm day, all disparities of a camera with f = 700 pixels shift by a tenth of a pixel, and
// distances change accordingly: by 1 % at a disparity of 10 pixels.
//
// The offset becomes visible when the camera moves: a thing grows in the picture with its true distance, and its
// measured disparity should grow by the same ratio r. If disparities are too large by delta, the disparity of a point
// that comes nearer falls short of its growth by delta (r - 1).
#pragma once

#include <cstdint>
#include <span>

#include "frontend/vision/motion.h"

namespace relmap::tracking {

class StereoOffset {
 public:
  double pixels() const { return pixels_; }  // to be subtracted from measured disparities
  double sigma() const;                      // standard deviation of pixels()

  // Updates the offset from the motion between two keyframes and its inliers. The offset so far must have been
  // subtracted from both their points and their pixels.
  void learn(std::span<const vision::Correspondence> correspondences, const SE3& T_reference_camera,
             const StereoCamera& camera);

 private:
  double pixels_ = 0;
  double information_ = 25;  // 1/px^2; the prior sigma is a fifth of a pixel
};

}  // namespace relmap::tracking
