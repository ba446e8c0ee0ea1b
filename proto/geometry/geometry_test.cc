#include "proto/geometry/geometry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace relmap {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Twists whose rotation is zero, tiny, near each threshold of the series, middling, and close to pi.
std::vector<Vector6> twists() {
  std::vector<Vector6> all;
  for (const double angle : {0., 1e-9, 1e-5, 9.9e-4, 1.01e-3, 0.0199, 0.0201, 0.3, 1.5, 3.0, kPi - 1e-4})
    for (const Vector3& axis : {Vector3(1, 0, 0), Vector3(0.3, -0.8, 0.52), Vector3(-0.1, 0.2, -0.97)}) {
      Vector6 xi;
      xi << 1.5, -0.7, 2.2, angle * axis.normalized();
      all.push_back(xi);
    }
  return all;
}

double angle_of(const Vector6& xi) { return xi.tail<3>().norm(); }

TEST(Se3, ExpIsTheSolutionOfItsDifferentialEquation) {
  // d/ds Exp(s xi) = Exp(s xi) xi^, integrated by the fourth-order Runge-Kutta method.
  for (const Vector6& xi : twists()) {
    Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
    generator.topLeftCorner<3, 3>() = skew(xi.tail<3>());
    generator.topRightCorner<3, 1>() = xi.head<3>();
    Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
    const int steps = 400;
    const Eigen::Matrix4d h = generator / steps;
    for (int i = 0; i < steps; ++i)
      T = T * (Eigen::Matrix4d::Identity() +
               h * (Eigen::Matrix4d::Identity() +
                    h / 2 * (Eigen::Matrix4d::Identity() + h / 3 * (Eigen::Matrix4d::Identity() + h / 4))));
    const SE3 e = SE3::exp(xi);
    EXPECT_LT((e.R - T.topLeftCorner<3, 3>()).norm(), 1e-9) << "angle " << angle_of(xi);
    EXPECT_LT((e.t - T.topRightCorner<3, 1>()).norm(), 1e-9) << "angle " << angle_of(xi);
    EXPECT_LT((e.R * e.R.transpose() - Matrix3::Identity()).norm(), 1e-14);
  }
}

TEST(Se3, LogIsTheInverseOfExp) {
  for (const Vector6& xi : twists()) EXPECT_LT((SE3::exp(xi).log() - xi).norm(), 1e-9) << "angle " << angle_of(xi);
}

TEST(Se3, LogOfAHalfTurnIsAHalfTurn) {
  const Matrix3 half_turn = Vector3(-1, 1, -1).asDiagonal();
  EXPECT_NEAR(so3_log(half_turn).norm(), kPi, 1e-12);
  EXPECT_NEAR(std::abs(so3_log(half_turn).y()), kPi, 1e-12);
}

TEST(Se3, InverseAndProductAreThoseOfMatrices) {
  const SE3 a = SE3::exp(twists()[20]), b = SE3::exp(twists()[25]);
  const Vector3 p(0.3, -2, 5);
  EXPECT_LT(((a * b) * p - a * (b * p)).norm(), 1e-12);
  EXPECT_LT((a.inverse() * (a * p) - p).norm(), 1e-12);
}

TEST(Se3, AdjointCarriesAPerturbationAcross) {
  for (const Vector6& at : twists()) {
    const SE3 T = SE3::exp(at);
    for (const Vector6& xi : twists()) {
      const SE3 left = T * SE3::exp(xi) * T.inverse(), right = SE3::exp(T.adjoint() * xi);
      EXPECT_LT((left.R - right.R).norm(), 1e-9);
      EXPECT_LT((left.t - right.t).norm(), 1e-8);
    }
  }
}

TEST(Se3, RightJacobianInverseIsTheDerivativeOfLog) {
  for (const Vector6& r : twists()) {
    const SE3 T = SE3::exp(r);
    Matrix6 numeric;
    const double h = 1e-5;
    for (int i = 0; i < 6; ++i) {
      Vector6 step = Vector6::Zero();
      step[i] = h;
      numeric.col(i) = ((T * SE3::exp(step)).log() - (T * SE3::exp(-step)).log()) / (2 * h);
    }
    EXPECT_LT((right_jacobian_inverse(r) - numeric).cwiseAbs().maxCoeff(), 2e-7) << "angle " << angle_of(r);
  }
}

TEST(Covariance, CompoundsAndInvertsToFirstOrder) {
  // Column by column, the right perturbation of the result that a perturbation of each factor causes.
  const SE3 T_ab = SE3::exp(twists()[22]), T_bc = SE3::exp(twists()[25]);
  Matrix6 from_first, from_inverse;
  const double h = 1e-6;
  for (int i = 0; i < 6; ++i) {
    Vector6 step = Vector6::Zero();
    step[i] = h;
    from_first.col(i) = ((T_ab * T_bc).inverse() * (T_ab * SE3::exp(step) * T_bc)).log() / h;
    from_inverse.col(i) = (T_ab * (T_ab * SE3::exp(step)).inverse()).log() / h;
  }
  Matrix6 s_ab = Matrix6::Identity(), s_bc = Matrix6::Identity();
  s_ab.diagonal() << 1, 2, 3, 0.1, 0.2, 0.3;
  s_ab(0, 4) = s_ab(4, 0) = 0.2;
  s_bc *= 0.5;
  EXPECT_LT((compound_covariance(s_ab, T_bc, s_bc) - (from_first * s_ab * from_first.transpose() + s_bc)).norm(), 1e-4);
  EXPECT_LT((inverse_covariance(T_ab, s_ab) - from_inverse * s_ab * from_inverse.transpose()).norm(), 1e-4);
}

TEST(RotationAngle, IsThatOfTheAxisAngle) {
  for (const double angle : {0.0, 1e-3, 0.5, 2.0, 3.1})
    EXPECT_NEAR(rotation_angle(so3_exp(angle * Vector3(0.6, 0, -0.8))), angle, 1e-7);
}

}  // namespace
}  // namespace relmap
