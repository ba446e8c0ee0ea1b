#include "proto/geometry/geometry.h"

#include <algorithm>
#include <cmath>

namespace relmap {

namespace {

// sin(x)/x, (1 - cos x)/x^2, (x - sin x)/x^3, with their series near zero.
struct Coefficients {
  double a, b, c;
  explicit Coefficients(double x) {
    const double x2 = x * x;
    if (x < 1e-3) {
      a = 1 - x2 / 6 * (1 - x2 / 20);
      b = 0.5 * (1 - x2 / 12 * (1 - x2 / 30));
      c = (1 - x2 / 20 * (1 - x2 / 42)) / 6;
    } else {
      a = std::sin(x) / x;
      b = (1 - std::cos(x)) / x2;
      c = (x - std::sin(x)) / (x2 * x);
    }
  }
};

Matrix3 left_jacobian(const Vector3& phi) {
  const Coefficients k(phi.norm());
  const Matrix3 w = skew(phi);
  return Matrix3::Identity() + k.b * w + k.c * w * w;
}

Matrix3 left_jacobian_inverse(const Vector3& phi) {
  const double x = phi.norm();
  const Matrix3 w = skew(phi);
  // 1/x^2 - (1 + cos x) / (2 x sin x)
  const double d =
      x < 1e-3 ? 1.0 / 12 * (1 + x * x / 60) : 1 / (x * x) * (1 - 0.5 * x * std::cos(x / 2) / std::sin(x / 2));
  return Matrix3::Identity() - 0.5 * w + d * w * w;
}

}  // namespace

Matrix3 skew(const Vector3& v) {
  Matrix3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Matrix3 so3_exp(const Vector3& phi) {
  const Coefficients k(phi.norm());
  const Matrix3 w = skew(phi);
  return Matrix3::Identity() + k.a * w + k.b * w * w;
}

Vector3 so3_log(const Matrix3& rotation) {
  // The quaternion is well conditioned at every angle.
  Eigen::Quaterniond q(rotation);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double n = q.vec().norm();
  if (n < 1e-12) return 2 * q.vec();
  return 2 * std::atan2(n, q.w()) / n * q.vec();
}

SE3 SE3::exp(const Vector6& xi) {
  const Vector3 phi = xi.tail<3>();
  return {so3_exp(phi), left_jacobian(phi) * xi.head<3>()};
}

Vector6 SE3::log() const {
  const Vector3 phi = so3_log(R);
  Vector6 xi;
  xi << left_jacobian_inverse(phi) * t, phi;
  return xi;
}

Matrix6 SE3::adjoint() const {
  Matrix6 ad;
  ad << R, skew(t) * R, Matrix3::Zero(), R;
  return ad;
}

Matrix6 right_jacobian_inverse(const Vector6& r) {
  // Jr(r) = Jl(-r), and Jl = [J, Q; 0, J].
  const Vector3 rho = -r.head<3>();
  const Vector3 phi = -r.tail<3>();
  const double x = phi.norm();
  const Matrix3 P = skew(rho);
  const Matrix3 W = skew(phi);
  double c1, c2, c3;  // (x - sin x)/x^3, (x^2/2 + cos x - 1)/x^4, (2x - 3 sin x + x cos x)/(2 x^5)
  const double x2 = x * x;
  if (x < 2e-2) {
    c1 = 1.0 / 6 - x2 / 120;
    c2 = 1.0 / 24 - x2 / 720;
    c3 = 1.0 / 120 - x2 / 2520;
  } else {
    c1 = (x - std::sin(x)) / (x2 * x);
    c2 = (x2 / 2 + std::cos(x) - 1) / (x2 * x2);
    c3 = (2 * x - 3 * std::sin(x) + x * std::cos(x)) / (2 * x2 * x2 * x);
  }
  const Matrix3 Q = 0.5 * P + c1 * (W * P + P * W + W * P * W) + c2 * (W * W * P + P * W * W - 3 * W * P * W) +
                    c3 * (W * P * W * W + W * W * P * W);
  const Matrix3 J_inverse = left_jacobian_inverse(phi);
  Matrix6 result;
  result << J_inverse, -J_inverse * Q * J_inverse, Matrix3::Zero(), J_inverse;
  return result;
}

Matrix6 compound_covariance(const Matrix6& s_ab, const SE3& T_bc, const Matrix6& s_bc) {
  const Matrix6 ad = T_bc.inverse().adjoint();
  return ad * s_ab * ad.transpose() + s_bc;
}

Matrix6 inverse_covariance(const SE3& T_ab, const Matrix6& s_ab) {
  const Matrix6 ad = T_ab.adjoint();
  return ad * s_ab * ad.transpose();
}

double rotation_angle(const Matrix3& rotation) { return std::acos(std::clamp((rotation.trace() - 1) / 2, -1.0, 1.0)); }

}  // namespace relmap
