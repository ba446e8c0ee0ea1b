#include "frontend/tracking/stereo_offset.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace relmap::tracking {

namespace {

constexpr double kMaxOffset = 1.0;  // pixels
constexpr double kShare = 0.05;     // of the information counts, since a landmark's error is the same in all its steps
constexpr double kMaxInformation = 2.5e3;  // 1/px^2; a limit, so that the offset can follow a camera that warms up
constexpr double kMinUsedDepth = 0.2;      // metres

using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

}  // namespace

double StereoOffset::sigma() const { return 1 / std::sqrt(information_); }

void StereoOffset::learn(std::span<const vision::Correspondence> correspondences, const SE3& T_reference_camera,
                         const StereoCamera& camera) {
  // One Gauss-Newton step from the estimated motion, with the offset as a seventh unknown.
  const SE3 T_camera_reference = T_reference_camera.inverse();
  Matrix7 A = Matrix7::Zero();
  Vector7 b = Vector7::Zero();
  for (const vision::Correspondence& c : correspondences) {
    const Vector3 p = T_camera_reference * c.point;
    if (is_mono(c.pixel) || !(p.z() > kMinUsedDepth) || !(c.point.z() > kMinUsedDepth)) continue;
    const Matrix3 H = camera.jacobian(p);
    const Matrix3 HR = H * T_camera_reference.R;
    Eigen::Matrix<double, 3, 7> J;
    J.leftCols<3>() = -H;
    J.middleCols<3>(3) = H * skew(p);
    // Per pixel of offset, a point p with disparity d moves by p/d, and each right pixel by one.
    J.col(6) = HR * c.point * (c.point.z() / (camera.f * camera.baseline));
    J(2, 6) -= 1;
    const Matrix3 W = (c.sigma * c.sigma * Matrix3::Identity() + HR * c.point_covariance * HR.transpose()).inverse();
    const Vector3 residual = c.pixel - camera.project(p);
    const double norm = std::sqrt(residual.dot(W * residual) / 3);
    const double weight = norm > 1.5 ? 1.5 / norm : 1;
    A += weight * J.transpose() * W * J;
    b += weight * J.transpose() * W * residual;
  }
  const Matrix6 pose = A.topLeftCorner<6, 6>();
  const auto factor = pose.ldlt();
  const Vector6 cross = A.topRightCorner<6, 1>();
  const double information = A(6, 6) - cross.dot(factor.solve(cross));
  const double gradient = b(6) - cross.dot(factor.solve(Vector6(b.head<6>())));
  if (!(information > 1e-6) || !std::isfinite(gradient)) return;
  const double added = kShare * information, found = gradient / information;
  const double step = added / (information_ + added) * std::clamp(found, -0.5, 0.5);
  pixels_ = std::clamp(pixels_ + step, -kMaxOffset, kMaxOffset);
  information_ = std::min(information_ + added, kMaxInformation);
}

}  // namespace relmap::tracking
