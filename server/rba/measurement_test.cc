#include "server/rba/measurement.h"

#include <gtest/gtest.h>

#include <random>

#include "proto/linear/huber.h"

namespace relmap::rba {
namespace {

using Matrix36 = Eigen::Matrix<double, 3, 6>;

// E of the landmark.
Matrix36 lever(const Vector3& abr) {
  Matrix36 e;
  e.leftCols<3>() = abr.z() * Matrix3::Identity();
  e.rightCols<3>() = -skew(ray(abr));
  return e;
}

const StereoCamera kCamera{400, 256, 192, 0.12, 512, 384};

SE3 random_pose(std::mt19937* random, double metres, double radians) {
  std::normal_distribution<double> normal;
  Vector6 xi;
  for (int k = 0; k < 6; ++k) xi[k] = normal(*random) * (k < 3 ? metres : radians);
  return SE3::exp(xi);
}

Vector3 prediction(const SE3& T_ij, const Vector3& abr, bool mono) {
  StereoPixel h;
  EXPECT_TRUE(predict(kCamera, scaled_point(T_ij, abr), abr.z(), &h));
  if (mono) h.z() = 0;
  return h;
}

// Central differences of f about zero, column by column.
template <int N, typename F>
Eigen::Matrix<double, 3, N> differences(const F& f) {
  const double step = 1e-6;
  Eigen::Matrix<double, 3, N> result;
  for (int k = 0; k < N; ++k) {
    Eigen::Matrix<double, N, 1> x = Eigen::Matrix<double, N, 1>::Zero();
    x[k] = step;
    result.col(k) = (f(x) - f(-x)) / (2 * step);
  }
  return result;
}

void expect_close(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  EXPECT_LT((a - b).norm(), 1e-6 * b.norm()) << a << "\n\n" << b;
}

class Measurement : public ::testing::TestWithParam<bool> {
 protected:
  bool mono() const { return GetParam(); }
  std::mt19937 random_{7};
  Vector3 abr() {
    std::uniform_real_distribution<double> wide(-0.5, 0.5), inverse_depth(0.02, 0.6);
    return {wide(random_), wide(random_), inverse_depth(random_)};
  }
};

TEST_P(Measurement, PredictsTheProjectionOfThePoint) {
  for (int k = 0; k < 20; ++k) {
    const SE3 T_ij = random_pose(&random_, 0.2, 0.1);
    const Vector3 l = abr();
    Vector3 expected = kCamera.project(T_ij * (ray(l) / l.z()));
    if (mono()) expected.z() = 0;
    EXPECT_LT((prediction(T_ij, l, mono()) - expected).norm(), 1e-9);
  }
}

TEST_P(Measurement, JacobiansMatchFiniteDifferences) {
  for (int k = 0; k < 20; ++k) {
    const SE3 T_ij = random_pose(&random_, 0.2, 0.1);
    const Vector3 l = abr();
    const MeasurementJacobian j = measurement_jacobian(kCamera, T_ij, scaled_point(T_ij, l), l.z(), mono());
    expect_close(j.d_landmark, differences<3>([&](const Vector3& d) { return prediction(T_ij, l + d, mono()); }));
    expect_close(j.G * lever(l),
                 differences<6>([&](const Vector6& d) { return prediction(T_ij * SE3::exp(d), l, mono()); }));
  }
}

TEST_P(Measurement, EdgesReachTheMeasurementThroughThetaInBothDirections) {
  for (int k = 0; k < 20; ++k) {
    const SE3 T_jx = random_pose(&random_, 0.2, 0.2), T_xy = random_pose(&random_, 0.2, 0.2);
    const SE3 T_yi = random_pose(&random_, 0.1, 0.1);
    const SE3 T_jy = T_jx * T_xy;
    const SE3 T_ij = (T_jy * T_yi).inverse();
    const Vector3 l = abr();
    const MeasurementJacobian j = measurement_jacobian(kCamera, T_ij, scaled_point(T_ij, l), l.z(), mono());
    expect_close(j.G * lever(l) * edge_to_theta(true, T_jx, T_jy), differences<6>([&](const Vector6& d) {
                   return prediction((T_jx * T_xy * SE3::exp(d) * T_yi).inverse(), l, mono());
                 }));
    const SE3 T_yx = T_xy.inverse();
    expect_close(j.G * lever(l) * edge_to_theta(false, T_jx, T_jy), differences<6>([&](const Vector6& d) {
                   return prediction((T_jx * (T_yx * SE3::exp(d)).inverse() * T_yi).inverse(), l, mono());
                 }));
  }
}

INSTANTIATE_TEST_SUITE_P(StereoAndMono, Measurement, ::testing::Bool(),
                         [](const auto& instance) { return instance.param ? "Mono" : "Stereo"; });

TEST(Prior, JacobianMatchesFiniteDifferences) {
  std::mt19937 random(8);
  const double step = 1e-6;
  for (int k = 0; k < 20; ++k) {
    const SE3 prior = random_pose(&random, 1, 0.5), T = prior * random_pose(&random, 0.3, 0.3);
    const Matrix6 J = right_jacobian_inverse((prior.inverse() * T).log());
    Matrix6 expected;
    for (int c = 0; c < 6; ++c) {
      Vector6 d = Vector6::Zero();
      d[c] = step;
      expected.col(c) =
          ((prior.inverse() * T * SE3::exp(d)).log() - (prior.inverse() * T * SE3::exp(-d)).log()) / (2 * step);
    }
    EXPECT_LT((J - expected).norm(), 1e-6 * expected.norm());
  }
}

TEST(Prediction, RefusesPointsBehindTheCamera) {
  StereoPixel h;
  EXPECT_FALSE(predict(kCamera, {0, 0, 0}, 0.1, &h));
  EXPECT_FALSE(predict(kCamera, {0, 0, -1}, 0.1, &h));
  EXPECT_FALSE(predict(kCamera, {0, 0, std::nan("")}, 0.1, &h));
}

// Against sums over the distribution of the norm of a Gaussian residual in three coordinates.
TEST(Measurement, HuberOverstatesCovariancesByItsFactor) {
  for (const double k : {0.5, 1.0, 2.0, 4.0}) {
    const double step = 1e-4;
    double weight = 0, slope = 0, square = 0;
    for (double e = step / 2; e < 12; e += step) {
      const double p = std::sqrt(2 / std::numbers::pi) * e * e * std::exp(-e * e / 2) * step;
      const double w = huber_weight(e, k);
      weight += p * w;
      slope += p * (w - (e > k ? w / 3 : 0));  // along the residual it is zero beyond the corner
      square += p * w * w * e * e / 3;
    }
    EXPECT_NEAR(huber_covariance_factor(k), square * weight / (slope * slope), 1e-6) << k;
  }
  EXPECT_NEAR(huber_covariance_factor(20), 1, 1e-12);
}

}  // namespace
}  // namespace relmap::rba
