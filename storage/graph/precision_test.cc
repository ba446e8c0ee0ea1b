#include "storage/graph/precision.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "storage/testing/random_frames.h"

namespace relmap::storage {
namespace {

constexpr double kAngle = 4 * 0x1p-34, kLength = 0x1p-27;

TEST(Precision, RoundsPosesByLessThanAStepAndOnlyOnce) {
  RandomFrames random(1);
  for (int i = 0; i < 10000; ++i) {
    const SE3 T = random.transform();
    const SE3 once = rounded(T);
    EXPECT_LT((once.R - T.R).cwiseAbs().maxCoeff(), kAngle);
    EXPECT_LT((once.t - T.t).cwiseAbs().maxCoeff(), kLength);
    EXPECT_LT((once.R.transpose() * once.R - Matrix3::Identity()).cwiseAbs().maxCoeff(), 1e-15 * 8);
    const SE3 twice = rounded(once);
    EXPECT_EQ(twice.R, once.R);
    EXPECT_EQ(twice.t, once.t);
  }
}

TEST(Precision, RoundsHalfTurnsAboutAnyAxis) {
  RandomFrames random(2);
  for (int i = 0; i < 1000; ++i) {
    const Vector3 axis = random.transform().R.col(0);
    for (const double less : {0.0, 1e-12, 1e-9, 1e-6, 1e-3}) {
      const SE3 T{so3_exp((std::numbers::pi - less) * axis), Vector3::Zero()};
      EXPECT_LT((rounded(T).R - T.R).cwiseAbs().maxCoeff(), kAngle) << less;
    }
  }
}

TEST(Precision, KeepsCovariancesSymmetricAndPositive) {
  for (int i = 0; i < 1000; ++i) {
    Matrix6 root = Matrix6::Random();
    root.row(0) *= 1e3;
    root.row(5) *= 1e-4;
    const Matrix6 exact = root * root.transpose() + 1e-9 * Matrix6::Identity();
    const Matrix6 kept = rounded(exact);
    EXPECT_EQ(kept, Matrix6(kept.transpose()));
    EXPECT_EQ(rounded(kept), kept);
    EXPECT_LT(
        ((kept - exact).array().abs() / (exact.diagonal() * exact.diagonal().transpose()).array().sqrt()).maxCoeff(),
        6e-8);
  }
}

// Even where the compiler would drop a conversion to float and back.
TEST(Precision, LandmarksAreFloats) {
  FrameHot frame;
  frame.landmarks.resize(9);
  for (std::size_t i = 0; i < frame.landmarks.size(); ++i)
    frame.landmarks[i].abr = Vector3(0.1, -0.7, 0.3) / static_cast<double>(i + 1);
  round_estimates(frame);
  for (const Landmark& landmark : frame.landmarks)
    for (const double value : landmark.abr) {
      const volatile float single = static_cast<float>(value);
      EXPECT_EQ(single, value);
    }
}

TEST(Precision, LeavesNonFiniteValuesAloneAndNeverLowersAnInverseDepth) {
  FrameHot frame;
  frame.landmarks.resize(3);
  frame.landmarks[0].abr = {0.1, 0.2, 1e-5};
  frame.landmarks[1].abr = {std::nan(""), 0.1, 0.2};
  frame.landmarks[2].abr = {1e300, 0.1, 0.2};
  frame.T_odom_frame.t = {1e12, 0.1, 0.2};
  round_estimates(frame);
  EXPECT_GE(frame.landmarks[0].abr.z(), 1e-5);
  EXPECT_TRUE(std::isnan(frame.landmarks[1].abr.x()));
  EXPECT_EQ(frame.landmarks[2].abr.x(), 1e300);
  EXPECT_EQ(frame.T_odom_frame.t.y(), 0.1);
}

TEST(Precision, CorrelationsAreKeptToAHundredth) {
  const Matrix6 own = Vector6(1e-4, 4e-4, 1e-4, 1e-6, 2e-6, 1e-6).asDiagonal();
  const Matrix6 previous = 3 * own;
  Matrix6 common = Matrix6::Zero();
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column)
      common(row, column) = (row - column) / 7.0 * std::sqrt(own(row, row) * previous(column, column));
  const Matrix6 back = from_correlation(to_correlation(common, own, previous), own, previous);
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column)
      EXPECT_NEAR(back(row, column), common(row, column), 0.01 * std::sqrt(own(row, row) * previous(column, column)));
  EXPECT_EQ(to_correlation(common, Matrix6::Zero(), previous), Edge().correlation_with_previous);
}

}  // namespace
}  // namespace relmap::storage
