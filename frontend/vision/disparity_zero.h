// Which disparity far things have, by motion: 0 of a calibrated camera.
//
// While the camera moves, a thing moves in the picture, apart from the camera's turn, in proportion to its inverse
// depth, and so to its true disparity. The disparity at which the motion vanishes is that of things infinitely far
// away. A yaw of one eye shifts all disparities by f tan(yaw), which no single pair shows where nothing is far away.
#pragma once

#include <optional>
#include <vector>

#include "proto/geometry/camera.h"

namespace relmap::vision {

// What the left eye saw at (u, v) with disparity u_left - u_right, and sees a moment later at (u_later, v_later).
// Pixels of rectified pictures.
struct MovedCorner {
  double u = 0, v = 0, disparity = 0, u_later = 0, v_later = 0;
};

struct DisparityZero {
  double pixels = 0, sigma = 0;
  int corners = 0;  // that agree
};

// From one motion. Nothing: fewer than 30 corners agree, or the motion tells less than to kMaxZeroSigma: the camera
// stood, only turned, or everything is equally far away.
inline constexpr double kMaxZeroSigma = 1.5;  // pixels
std::optional<DisparityZero> disparity_zero(const std::vector<MovedCorner>& corners, const StereoCamera& camera);

}  // namespace relmap::vision
