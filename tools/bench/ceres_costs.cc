#include "tools/bench/ceres_costs.h"

#include <algorithm>

namespace relmap::bench {

namespace {

Eigen::Quaterniond quaternion(const double* q_t) { return Eigen::Quaterniond(q_t[3], q_t[0], q_t[1], q_t[2]); }

void put(const SE3& pose, double* q_t) {
  const Eigen::Quaterniond q = pose.quaternion().normalized();
  std::copy_n(q.coeffs().data(), 4, q_t);
  std::copy_n(pose.t.data(), 3, q_t + 4);
}

SE3 pose_of(const double* q_t) { return SE3::from_quaternion(quaternion(q_t), Vector3(q_t[4], q_t[5], q_t[6])); }

}  // namespace

CeresPose::CeresPose(const SE3& T_world_frame) { put(T_world_frame, q_t); }

SE3 CeresPose::pose() const { return pose_of(q_t); }

bool PoseManifold::Plus(const double* x, const double* delta, double* result) const {
  put(pose_of(x) * SE3::exp(Eigen::Map<const Vector6>(delta)), result);
  return true;
}

bool PoseManifold::PlusJacobian(const double*, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> J(jacobian);
  J.setZero();
  J.topRows<6>().setIdentity();
  return true;
}

bool StereoCost::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const Matrix3 R = quaternion(parameters[0]).toRotationMatrix();  // of T_world_frame
  const Vector3 t(parameters[0][4], parameters[0][5], parameters[0][6]);
  const Vector3 p = R.transpose() * (Eigen::Map<const Vector3>(parameters[1]) - t);
  if (!(p.z() > 1e-3)) return false;
  const double k = camera_.f / p.z();
  const Vector3 h(k * p.x() + camera_.cx, k * p.y() + camera_.cy, k * (p.x() - camera_.baseline) + camera_.cx);
  Eigen::Map<Vector3> r(residuals);
  r = weight_.cwiseProduct(h - z_);
  if (!jacobians) return true;
  Matrix3 d_p;  // dh / dp, whitened
  d_p << k, 0, -k * p.x() / p.z(), 0, k, -k * p.y() / p.z(), k, 0, -k * (p.x() - camera_.baseline) / p.z();
  d_p = weight_.asDiagonal() * d_p;
  if (jacobians[0]) {
    Eigen::Map<Eigen::Matrix<double, 3, 7, Eigen::RowMajor>> J(jacobians[0]);
    J.leftCols<3>() = -d_p;
    J.middleCols<3>(3) = d_p * skew(p);
    J.col(6).setZero();
  }
  if (jacobians[1]) {
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> J(jacobians[1]);
    J = d_p * R.transpose();
  }
  return true;
}

}  // namespace relmap::bench
