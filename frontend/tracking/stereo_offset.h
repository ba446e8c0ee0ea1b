// What rectification has left between the columns of the two eyes. A turn of one eye by a hundredth of a degree, which
// every calibration has after a warm day, shifts all disparities of a camera of 700 pixels by a tenth of a pixel, and
// with them every distance: at 10 pixels of disparity by a hundredth.
//
// It shows when the camera moves: things grow in the picture by their true distance, and their disparities by the
// measured one. With disparities too large by delta, a point that comes nearer by the ratio r is seen with a disparity
// that is too small for its growth by delta (r - 1).
#pragma once

#include <cstdint>
#include <span>

#include "frontend/vision/motion.h"

namespace relmap::tracking {

class StereoOffset {
 public:
  double pixels() const { return pixels_; }  // to be taken off measured disparities
  double sigma() const;

  // From the motion between two keyframes and the correspondences that agreed with it. Both their points and their
  // pixels have the offset known so far taken off.
  void learn(std::span<const vision::Correspondence> correspondences, const SE3& T_reference_camera,
             const StereoCamera& camera);

 private:
  double pixels_ = 0;
  double information_ = 25;  // 1/px^2: a fifth of a pixel to begin with
};

}  // namespace relmap::tracking
