// A lens with radial distortion.
#pragma once

#include <optional>

#include "proto/geometry/geometry.h"

namespace relmap::vision {

// The intrinsic parameters of an uncalibrated camera: focal length, radial distortion, principal point and aspect
// ratio. With x = X/Z, y = Y/Z, r2 = x^2 + y^2, g = 1 + k1 r2 + k2 r2^2 a point is seen at pixel (f g x + cx, aspect f
// g y + cy). This is RawCamera's model without tangential distortion.
struct Lens {
  double f = 0, cx = 0, cy = 0;  // pixels
  double k1 = 0, k2 = 0;
  double aspect = 1;  // vertical / horizontal focal length; not 1 in a picture that was stretched

  enum Parameter : int { kLogF, kK1, kK2, kCx, kCy, kLogAspect };
  static constexpr int kParameters = 6;
  using Parameters = Eigen::Matrix<double, kParameters, 1>;
  using PointJacobian = Eigen::Matrix<double, 2, 3>;
  using LensJacobian = Eigen::Matrix<double, 2, kParameters>;

  // The pixel at which the point p of the camera's frame (p.z > 0) is seen, and its derivatives by p and by the
  // parameters.
  Vector2 project(const Vector3& p) const;
  PointJacobian jacobian(const Vector3& p) const;
  LensJacobian lens_jacobian(const Vector3& p) const;
  // The normalised coordinates (x, y) of what is seen at `pixel`; nothing if slope() falls to kMinSlope on the way, or
  // the iteration does not converge.
  std::optional<Vector2> undistort(const Vector2& pixel) const;
  // The derivative of the distorted distance from the centre by the undistorted one, whose square is r2 (both
  // normalised). Below kMinSlope, near the turning point of the distortion, one pixel covers too wide an angle.
  double slope(double r2) const { return 1 + r2 * (3 * k1 + r2 * 5 * k2); }
  static constexpr double kMinSlope = 0.1;
  // This lens with its parameters changed by `step`.
  Lens plus(const Parameters& step) const;
  // The step that takes `from` to this lens: from.plus(minus(from)) is this lens.
  Parameters minus(const Lens& from) const;
};

}  // namespace relmap::vision
