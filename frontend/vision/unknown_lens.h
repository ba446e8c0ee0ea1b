// The motion of a camera that nobody has calibrated: a photograph from anywhere against points of the map.
#pragma once

#include <optional>
#include <span>

#include "frontend/vision/motion.h"

namespace relmap {

// What is unknown of a camera with square pixels: its focal length, radial distortion and principal point. With x =
// X/Z, y = Y/Z, r2 = x^2 + y^2, g = 1 + k1 r2 + k2 r2^2 a point is seen at (f g x + cx, f g y + cy), pixels
// (RawCamera's model without tangential distortion).
struct Lens {
  double f = 0, cx = 0, cy = 0;  // pixels
  double k1 = 0, k2 = 0;

  static constexpr int kParameters = 5;  // log f, k1, k2, cx, cy
  using PointJacobian = Eigen::Matrix<double, 2, 3>;
  using LensJacobian = Eigen::Matrix<double, 2, kParameters>;

  // Where the point p of the camera's frame, p.z > 0, is seen; the derivatives of that by p and by the parameters.
  Vector2 project(const Vector3& p) const;
  PointJacobian jacobian(const Vector3& p) const;
  LensJacobian lens_jacobian(const Vector3& p) const;
  // The normalised coordinates (x, y) of what is seen at `pixel`; nothing where the distortion hardly moves on, or
  // turns.
  std::optional<Vector2> undistort(const Vector2& pixel) const;
  // The lens with its parameters changed by `step`.
  Lens plus(const Eigen::Matrix<double, kParameters, 1>& step) const;
};

struct MotionAndLens {
  Motion motion;  // its covariance has the uncertainty of the lens in it
  Lens lens;
  double sigma_log_f = 0;  // standard deviation of log f
};

// As estimate_motion(), for a camera of which only the picture's size is known: the rest of `camera` is not read, and
// disparities are not used. Focal lengths of 0.4 to 4 longer sides are tried, without distortion and with a wide
// lens's; from what most correspondences agree with, pose and lens are refined together, and more correspondences agree
// as the lens becomes known. What lenses are like is a prior: k1 and k2 move the picture's corners by 0 within 20 % and
// 10 % of their distance from the centre, and the principal point is the centre within 2 % of the longer side (one
// standard deviation each); of the focal length nothing is supposed. The covariance is the marginal one, over all
// lenses. TOO_FEW_INLIERS; NO_CALIBRATION: what is seen does not tell the focal length within 35 % (a wall seen from
// the front shows the same from near with a wide lens and from far with a long one).
Result<MotionAndLens> estimate_motion_and_lens(std::span<const Correspondence> correspondences,
                                               const StereoCamera& camera, const MotionOptions& options = {});

}  // namespace relmap
