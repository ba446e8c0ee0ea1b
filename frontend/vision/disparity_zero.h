// The disparity of points at infinity, measured from motion. It is 0 for a calibrated camera.
//
// When the camera moves, a point's motion in the picture, less the effect of the camera's rotation, is proportional to
// its inverse depth and so to its true disparity. The measured disparity at which that motion vanishes belongs to
// points at infinity. A yaw of one eye shifts all disparities by f tan(yaw), which a single pair cannot show unless it
// sees something far away.
#pragma once

#include <optional>
#include <vector>

#include "proto/geometry/camera.h"

namespace relmap::vision {

// A corner that the left eye saw at (u, v) with disparity u_left - u_right, and a moment later at (u_later, v_later),
// in pixels of rectified pictures.
struct MovedCorner {
  double u = 0, v = 0, disparity = 0, u_later = 0, v_later = 0;
};

struct DisparityZero {
  double pixels = 0, sigma = 0;  // the disparity and its standard deviation, in pixels
  int corners = 0;               // corners that agree with the motion
};

// Measures the disparity of points at infinity from one motion. Nothing if fewer than 30 corners agree, or if sigma
// would exceed kMaxZeroSigma: the camera stood still or only turned, or everything is equally far away.
inline constexpr double kMaxZeroSigma = 1.5;  // pixels
std::optional<DisparityZero> disparity_zero(const std::vector<MovedCorner>& corners, const StereoCamera& camera);

}  // namespace relmap::vision
