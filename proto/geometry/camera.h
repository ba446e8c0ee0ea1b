// The rectified stereo camera and its measurements (docs/method.md, 1).
#pragma once

#include <cmath>
#include <limits>

#include "proto/base/status.h"
#include "proto/geometry/geometry.h"

namespace relmap {

// z = (u_left, v, u_right) in pixels; u_right is NaN for a mono measurement.
using StereoPixel = Vector3;

inline constexpr double kNoRight = std::numeric_limits<double>::quiet_NaN();
inline bool is_mono(const StereoPixel& z) { return std::isnan(z.z()); }

// Pixel (0, 0) is the centre of the top left pixel.
struct StereoCamera {
  double f = 0;   // focal length, pixels (square pixels after rectification)
  double cx = 0;  // principal point, pixels
  double cy = 0;
  double baseline = 0;  // metres; 0 for a mono camera
  int width = 0;        // pixels
  int height = 0;

  bool operator==(const StereoCamera&) const = default;
  bool is_stereo() const { return baseline > 0; }

  // h(p), the pixels of p in the left camera's frame, p.z > 0.
  StereoPixel project(const Vector3& p) const {
    const double s = f / p.z();
    return {s * p.x() + cx, s * p.y() + cy, s * (p.x() - baseline) + cx};
  }
  // dh/dp.
  Matrix3 jacobian(const Vector3& p) const {
    const double s = f / p.z();
    Matrix3 H;
    H << s, 0, -s * p.x() / p.z(), 0, s, -s * p.y() / p.z(), s, 0, -s * (p.x() - baseline) / p.z();
    return H;
  }
  // The point that projects to z; needs u_left > u_right.
  Vector3 triangulate(const StereoPixel& z) const {
    const double depth = f * baseline / (z.x() - z.z());
    return {(z.x() - cx) / f * depth, (z.y() - cy) / f * depth, depth};
  }
  bool in_picture(double u, double v) const { return u >= -0.5 && v >= -0.5 && u <= width - 0.5 && v <= height - 0.5; }

  // IMPLAUSIBLE_CALIBRATION unless all numbers are finite, each side has 16..16384 pixels, f is 0.1..20 picture widths,
  // the principal point is inside the picture, and the baseline is 0 or 5 mm .. 10 m.
  Status check_plausible() const;
};

// Standard deviation in pixels of a coordinate measured at a pyramid level: 2^level, since each level has half the size
// of the one before.
inline double pixel_sigma(int level) { return static_cast<double>(1 << level); }
inline constexpr int kMaxPyramidLevel = 7;

// The camera of a session that was imported without pictures, since a session must have one. Nothing is measured with
// it.
inline constexpr StereoCamera kNoCamera{500, 320, 240, 0.1, 640, 480};

}  // namespace relmap
