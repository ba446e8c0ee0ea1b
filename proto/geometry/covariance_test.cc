#include "proto/geometry/covariance.h"

#include <gtest/gtest.h>

#include <limits>

namespace relmap {
namespace {

Matrix6 plausible() {
  Matrix6 m = Matrix6::Identity() * 1e-4;
  m(0, 1) = m(1, 0) = 5e-5;
  m(5, 5) = 1e-8;
  return m;
}

TEST(Covariance, UpperTriangleGoesBothWays) {
  Matrix6 m;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) m(i, j) = 10 * std::min(i, j) + std::max(i, j);
  const UpperTriangle values = upper_triangle(m);
  EXPECT_EQ(values[1], 1);
  EXPECT_EQ(values[6], 11);
  EXPECT_EQ(values[20], 55);
  EXPECT_EQ(from_upper_triangle(values), m);
}

TEST(Covariance, PlausibleOnesPass) {
  EXPECT_TRUE(check_covariance(plausible()).ok());
  Matrix6 scales = Matrix6::Zero();
  scales.diagonal() << 1e4, 1e-6, 1, 1e-12, 1e-2, 1;
  EXPECT_TRUE(check_covariance(scales).ok());
}

TEST(Covariance, ImplausibleOnesAreNamed) {
  const auto spoilt = [](int row, int column, double value) {
    Matrix6 m = plausible();
    m(row, column) = m(column, row) = value;
    return check_covariance(m).reason();
  };
  EXPECT_EQ(spoilt(2, 4, std::numeric_limits<double>::quiet_NaN()), Reason::NOT_FINITE);
  EXPECT_EQ(spoilt(3, 3, 0), Reason::BAD_COVARIANCE);
  EXPECT_EQ(spoilt(3, 3, -1), Reason::BAD_COVARIANCE);
  EXPECT_EQ(spoilt(3, 3, 1e13), Reason::BAD_COVARIANCE);
  EXPECT_EQ(spoilt(0, 1, 1e-4), Reason::BAD_COVARIANCE);  // fully correlated
  Matrix6 askew = plausible();
  askew(0, 1) *= 1.1;
  EXPECT_EQ(check_covariance(askew).reason(), Reason::BAD_COVARIANCE);
}

TEST(Covariance, TheMahalanobisDistanceIsTheNormOfTheWhitenedError) {
  Matrix6 root = Matrix6::Zero();  // lower triangular, so its product with its transpose is positive definite
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j) root(i, j) = i == j ? 0.1 * (i + 1) : 0.03 * (i - 2 * j);
  const Matrix6 covariance = root * root.transpose();
  Vector6 white;
  white << 1, -2, 0.5, 3, -1, 0.25;
  EXPECT_NEAR(mahalanobis_squared(Vector6(root * white), covariance), white.squaredNorm(), 1e-9);
  const Matrix3 root3 = root.topLeftCorner<3, 3>();
  EXPECT_NEAR(mahalanobis_squared(Vector3(root3 * white.head<3>()), Matrix3(root3 * root3.transpose())),
              white.head<3>().squaredNorm(), 1e-9);
  const Eigen::Matrix2d root2 = root.topLeftCorner<2, 2>();
  EXPECT_NEAR(mahalanobis_squared(Vector2(root2 * white.head<2>()), Eigen::Matrix2d(root2 * root2.transpose())),
              white.head<2>().squaredNorm(), 1e-9);
}

}  // namespace
}  // namespace relmap
