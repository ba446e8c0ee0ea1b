#include "frontend/vision/likeliest_point.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace relmap::vision {

namespace {

constexpr double kNearest = 1e-3;     // metres; nothing nearer can be seen
constexpr double kMinInverse = 0.05;  // of the measured inverse distance; less says nothing of the distance any more
// Of the distance, one sigma: what the shape of the error then moves a point by is of second order, 0.0004 of it.
constexpr double kWellKnown = 0.02;
constexpr int kIterations = 4;

// The point as a function of its error e in the reference frame, with mean zero and covariance c.point_covariance: what
// lies along the ray changes the inverse distance.
struct Moved {
  Vector3 point;
  Matrix3 jacobian;
};

}  // namespace

bool is_well_known(const Correspondence& c) {
  const Vector3 from_eye = c.point - c.seen_from;
  const double squared = from_eye.squaredNorm();
  return !(from_eye.dot(c.point_covariance * from_eye) > kWellKnown * kWellKnown * squared * squared);
}

Correspondence at_likeliest_point(const Correspondence& c, const StereoCamera& camera, const SE3& T_camera_reference) {
  const Vector3 from_eye = c.point - c.seen_from;
  const double distance = from_eye.norm();
  const Vector3 ray = from_eye / distance;
  const auto moved = [&](const Vector3& e) {
    const double inverse = std::max(kMinInverse, 1 - ray.dot(e) / distance);
    const Vector3 across = from_eye + e - ray * ray.dot(e);
    return Moved{c.seen_from + across / inverse, (Matrix3::Identity() - ray * ray.transpose()) / inverse +
                                                     across * ray.transpose() / (inverse * inverse * distance)};
  };
  // The iterated extended Kalman filter, whose fixed point is the maximum of the posterior (Bell and Cathey, IEEE TAC
  // 1993).
  const bool stereo = !is_mono(c.pixel) && camera.is_stereo();
  Vector3 e = Vector3::Zero();
  for (int iteration = 0;; ++iteration) {
    const Moved at = moved(e);
    const Vector3 p = T_camera_reference * at.point;
    if (!(p.z() > kNearest)) return c;
    Matrix3 H = camera.jacobian(p) * T_camera_reference.R * at.jacobian;
    if (!stereo) H.row(2).setZero();
    const Vector3 told = H * e;
    if (iteration == kIterations) {
      Correspondence result = c;
      result.point = at.point;
      result.point_covariance = at.jacobian * c.point_covariance * at.jacobian.transpose();
      result.pixel += told;  // NaN stays NaN
      return result;
    }
    Vector3 innovation = c.pixel - camera.project(p) + told;
    if (!stereo) innovation.z() = 0;
    const Matrix3 PHt = c.point_covariance * H.transpose();
    const Matrix3 S = H * PHt + c.sigma * c.sigma * Matrix3::Identity();
    e = PHt * S.ldlt().solve(innovation);
  }
}

}  // namespace relmap::vision
