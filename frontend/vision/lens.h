// A lens that may distort.
#pragma once

#include <optional>

#include "proto/geometry/geometry.h"

namespace relmap::vision {

// Focal length, radial distortion, principal point and the shape of its pixels: what is unknown of a camera that nobody
// has calibrated. With x = X/Z, y = Y/Z, r2 = x^2 + y^2, g = 1 + k1 r2 + k2 r2^2 a point is seen at
// (f g x + cx, aspect f g y + cy), pixels (RawCamera's model without tangential distortion).
struct Lens {
  double f = 0, cx = 0, cy = 0;  // pixels
  double k1 = 0, k2 = 0;
  double aspect = 1;  // of the focal lengths, vertical to horizontal: not 1 in a picture that was stretched

  enum Parameter : int { kLogF, kK1, kK2, kCx, kCy, kLogAspect };
  static constexpr int kParameters = 6;
  using Parameters = Eigen::Matrix<double, kParameters, 1>;
  using PointJacobian = Eigen::Matrix<double, 2, 3>;
  using LensJacobian = Eigen::Matrix<double, 2, kParameters>;

  // Where the point p of the camera's frame, p.z > 0, is seen; the derivatives of that by p and by the parameters.
  Vector2 project(const Vector3& p) const;
  PointJacobian jacobian(const Vector3& p) const;
  LensJacobian lens_jacobian(const Vector3& p) const;
  // The normalised coordinates (x, y) of what is seen at `pixel`; nothing where the distortion hardly moves on, or
  // turns.
  std::optional<Vector2> undistort(const Vector2& pixel) const;
  // The derivative by the normalised distance from the centre, whose square is r2, of the distance after distortion.
  // Towards the turning point of the distortion, where it falls below kMinSlope, a pixel is too much of the world.
  double slope(double r2) const { return 1 + r2 * (3 * k1 + r2 * 5 * k2); }
  static constexpr double kMinSlope = 0.1;
  // The lens with its parameters changed by `step`.
  Lens plus(const Parameters& step) const;
  // The step by which `from` becomes this lens.
  Parameters minus(const Lens& from) const;
};

}  // namespace relmap::vision
