#include <cmath>
#include <limits>
#include <string>

#include "proto/geometry/canonical_rotation.h"
#include "proto/wire/convert.h"

namespace relmap {

namespace {

v1::RawCamera raw_to_wire(const RawCamera& c) {
  v1::RawCamera wire;
  wire.set_fx(c.fx);
  wire.set_fy(c.fy);
  wire.set_cx(c.cx);
  wire.set_cy(c.cy);
  wire.set_k1(c.k1);
  wire.set_k2(c.k2);
  wire.set_p1(c.p1);
  wire.set_p2(c.p2);
  wire.set_k3(c.k3);
  return wire;
}

RawCamera raw_from_wire(const v1::RawCamera& c) {
  return {c.fx(), c.fy(), c.cx(), c.cy(), c.k1(), c.k2(), c.p1(), c.p2(), c.k3()};
}

int size_from_wire(std::uint32_t pixels) {
  return static_cast<int>(std::min<std::uint32_t>(pixels, std::numeric_limits<int>::max()));
}

}  // namespace

v1::Vector3 to_wire(const Vector3& v) {
  v1::Vector3 wire;
  wire.set_x(v.x());
  wire.set_y(v.y());
  wire.set_z(v.z());
  return wire;
}

v1::Transform to_wire(const SE3& T) {
  const QuaternionWxyz q = canonical_quaternion(T.R);
  v1::Transform wire;
  wire.mutable_rotation()->set_w(q[0]);
  wire.mutable_rotation()->set_x(q[1]);
  wire.mutable_rotation()->set_y(q[2]);
  wire.mutable_rotation()->set_z(q[3]);
  *wire.mutable_translation() = to_wire(T.t);
  return wire;
}

v1::Covariance to_wire(const Matrix6& covariance) {
  v1::Covariance wire;
  for (const double value : upper_triangle(covariance)) wire.add_upper(value);
  return wire;
}

Result<SE3> transform_of(const QuaternionWxyz& q, const Vector3& t) {
  const SE3 T{rotation_of(q), t};
  if (!T.R.allFinite() || !T.t.allFinite()) return {Reason::NOT_FINITE, "transform is not finite"};
  if (!is_rotation(T.R)) return {Reason::BAD_ROTATION, "quaternion is not of unit length"};
  return T;
}

Result<SE3> from_wire(const v1::Transform& T) {
  const v1::Quaternion& q = T.rotation();
  const v1::Vector3& t = T.translation();
  return transform_of({q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()});
}

Result<Matrix6> from_wire(const v1::Covariance& covariance) {
  UpperTriangle values;
  if (covariance.upper_size() != static_cast<int>(values.size()))
    return {Reason::BAD_SIZE, "covariance of " + std::to_string(covariance.upper_size()) + " numbers; must be 21"};
  std::copy(covariance.upper().begin(), covariance.upper().end(), values.begin());
  const Matrix6 m = from_upper_triangle(values);
  if (Status s = check_covariance(m); !s.ok()) return s;
  return m;
}

v1::Camera to_wire(const StereoCamera& camera) {
  v1::Camera wire;
  wire.set_f(camera.f);
  wire.set_cx(camera.cx);
  wire.set_cy(camera.cy);
  wire.set_baseline(camera.baseline);
  wire.set_width(static_cast<std::uint32_t>(camera.width));
  wire.set_height(static_cast<std::uint32_t>(camera.height));
  return wire;
}

Result<StereoCamera> from_wire(const v1::Camera& c) {
  const StereoCamera camera{c.f(), c.cx(), c.cy(), c.baseline(), size_from_wire(c.width()), size_from_wire(c.height())};
  if (Status s = camera.check_plausible(); !s.ok()) return s;
  return camera;
}

v1::RawStereo to_wire(const StereoCalibration& calibration) {
  v1::RawStereo wire;
  *wire.mutable_left() = raw_to_wire(calibration.left);
  if (!calibration.mono()) {
    *wire.mutable_right() = raw_to_wire(calibration.right);
    *wire.mutable_right_from_left() = to_wire(calibration.T_right_left);
  }
  wire.set_width(static_cast<std::uint32_t>(calibration.width));
  wire.set_height(static_cast<std::uint32_t>(calibration.height));
  return wire;
}

Result<StereoCalibration> from_wire(const v1::RawStereo& raw) {
  StereoCalibration calibration;
  calibration.left = raw_from_wire(raw.left());
  if (raw.has_right()) {
    calibration.right = raw_from_wire(raw.right());
    auto T = from_wire(raw.right_from_left());
    if (!T.ok()) return T.status();
    calibration.T_right_left = *T;
  }
  calibration.width = size_from_wire(raw.width());
  calibration.height = size_from_wire(raw.height());
  if (calibration.width == 0 || calibration.height == 0)
    return {Reason::IMPLAUSIBLE_CALIBRATION, "the calibration does not say how large the pictures are"};
  if (Status s = calibration.check_plausible(); !s.ok()) return s;
  return calibration;
}

}  // namespace relmap
