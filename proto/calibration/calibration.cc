#include "proto/calibration/calibration.h"

#include <algorithm>
#include <cmath>

#include "proto/base/refuse.h"
#include "proto/geometry/canonical_rotation.h"

namespace relmap {

namespace {

constexpr double kMaxTangential = 0.1;
constexpr double kMaxTurn = 20 * 3.14159265358979323846 / 180;  // between the eyes, radians

template <typename... Parts>
Status implausible(const Parts&... parts) {
  return refuse(Reason::IMPLAUSIBLE_CALIBRATION, parts...);
}

// True if the distortion is not monotonic out to the edge of the picture, so that two rays are seen in one pixel.
// `edge`: distance of the edge from the principal point, in focal lengths.
bool folds(const RawCamera& c, double edge) {
  constexpr int kSteps = 400;
  for (int i = 1; i <= kSteps; ++i) {
    const double r = 2 * edge * i / kSteps, r2 = r * r;
    if (1 + r2 * (3 * c.k1 + r2 * (5 * c.k2 + r2 * 7 * c.k3)) <= 0) return true;
    if (r * (1 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3))) >= edge) return false;
  }
  return true;  // a ray twice as far out as the edge is still inside the picture
}

Status check_camera(const char* eye, const RawCamera& c, int width, int height) {
  for (const double value : {c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3})
    if (!std::isfinite(value)) return implausible(eye, ": a number is not finite");
  if (!(c.fx > 0 && c.fy > 0) || std::abs(c.fx - c.fy) > 0.1 * c.fx)
    return implausible(eye, ": focal lengths ", c.fx, " and ", c.fy, " px; must be positive and within 10 %");
  if (std::abs(c.p1) > kMaxTangential || std::abs(c.p2) > kMaxTangential)
    return implausible(eye, ": tangential distortion ", c.p1, ", ", c.p2, "; at most ", kMaxTangential);
  if (width == 0) return {};
  const StereoCamera pinhole{c.fx, c.cx, c.cy, 0, width, height};
  if (const Status s = pinhole.check_plausible(); !s.ok()) return implausible(eye, ": ", s.message());
  if (folds(c, std::max(std::max(c.cx, width - c.cx) / c.fx, std::max(c.cy, height - c.cy) / c.fy)))
    return implausible(eye, ": distortion ", c.k1, ", ", c.k2, ", ", c.k3, " folds the picture over itself");
  return {};
}

Status check_pair(const SE3& T) {
  if (!T.R.allFinite() || !T.t.allFinite()) return implausible("the transform between the eyes is not finite");
  if (!is_rotation(T.R)) return implausible("the rotation between the eyes is no rotation");
  const double baseline = T.t.norm();
  if (baseline < 0.005 || baseline > 10)
    return implausible("baseline of ", baseline, " m; must be 0.005..10 m (is it in metres?)");
  if (-T.t.x() < 0.8 * baseline)
    return implausible("the right eye is not to the right of the left one: it stands at (", (T.inverse().t).transpose(),
                       ") m");
  if (rotation_angle(T.R) > kMaxTurn)
    return implausible("the eyes are turned by ", rotation_angle(T.R), " rad against each other; at most ", kMaxTurn);
  return {};
}

bool undistorted(const RawCamera& c) { return c.k1 == 0 && c.k2 == 0 && c.p1 == 0 && c.p2 == 0 && c.k3 == 0; }

Status check_rectified(const StereoCalibration& c) {
  if (c.left.fx != c.left.fy || !undistorted(c.left))
    return implausible("marked as rectified, but fx and fy differ, or there is distortion");
  if (c.mono()) return {};
  const bool parallel = c.T_right_left.R.isIdentity(1e-9) && c.T_right_left.t.tail<2>().norm() < 1e-9;
  if (!(c.left == c.right) || !parallel)
    return implausible("marked as rectified, but the eyes differ, or are not parallel");
  return {};
}

}  // namespace

StereoCamera StereoCalibration::rectified_camera() const {
  return {left.fx, left.cx, left.cy, mono() ? 0 : -T_right_left.t.x(), width, height};
}

StereoCalibration StereoCalibration::right_eye() const {
  StereoCalibration eye = *this;
  eye.left = right;
  eye.right = {};
  eye.T_right_left = SE3();
  eye.T_body_left = T_body_left * T_right_left.inverse();
  return eye;
}

Status StereoCalibration::check_plausible() const {
  if (Status s = check_camera("left eye", left, width, height); !s.ok()) return s;
  if (!mono()) {
    if (Status s = check_camera("right eye", right, width, height); !s.ok()) return s;
    if (Status s = check_pair(T_right_left); !s.ok()) return s;
  }
  if (rectified) return check_rectified(*this);
  return {};
}

}  // namespace relmap
