#include "frontend/tracking/landmark.h"

#include <gtest/gtest.h>

#include <random>

namespace relmap::tracking {
namespace {

const StereoCamera kRobotCamera{400, 256, 192, 0.12, 512, 384};

TEST(StereoEstimate, ConvertsToPixelsAndBack) {
  const Vector3 point{0.7, -0.4, 5};
  Vector3 same;
  Matrix3 covariance;
  from_pixels(kRobotCamera, {kRobotCamera.project(point), 0.25 * Matrix3::Identity()}, same, covariance);
  EXPECT_LT((same - point).norm(), 1e-12);
  const StereoEstimate estimate = to_pixels(kRobotCamera, point, covariance);
  EXPECT_LT((estimate.covariance - 0.25 * Matrix3::Identity()).norm(), 1e-9);
  Vector3 back;
  Matrix3 back_covariance;
  from_pixels(kRobotCamera, estimate, back, back_covariance);
  EXPECT_LT((back - point).norm(), 1e-12);
  EXPECT_LT((back_covariance - covariance).norm(), 1e-9 * covariance.norm());
}

TEST(JoinMeasurement, AveragesAndReducesTheCovariance) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.5);
  const Vector3 truth{0.5, 0.3, 8};
  const auto measured = [&] {
    return StereoPixel(kRobotCamera.project(truth) + Vector3(noise(random), noise(random), noise(random)));
  };
  double first = 0, last = 0;
  for (int run = 0; run < 50; ++run) {
    Vector3 point;
    Matrix3 covariance;
    from_pixels(kRobotCamera, {measured(), 0.25 * Matrix3::Identity()}, point, covariance);
    first += (point - truth).squaredNorm();
    const double before = covariance.trace();
    for (int i = 0; i < 15; ++i) ASSERT_TRUE(join_measurement(kRobotCamera, measured(), 0.5, point, covariance));
    last += (point - truth).squaredNorm();
    EXPECT_LT(covariance.trace(), before / 4);
  }
  EXPECT_LT(last, first / 5);
}

TEST(JoinMeasurement, OneEyeMovesThePointSidewaysOnly) {
  Vector3 point{0, 0, 5};
  Matrix3 covariance;
  from_pixels(kRobotCamera, {kRobotCamera.project(point), 0.25 * Matrix3::Identity()}, point, covariance);
  const StereoPixel predicted = kRobotCamera.project(point);
  ASSERT_TRUE(join_measurement(kRobotCamera, {predicted.x(), predicted.y() + 1, kNoRight}, 0.5, point, covariance));
  EXPECT_NEAR(kRobotCamera.project(point).y(), predicted.y() + 0.5, 1e-6);
  EXPECT_NEAR(point.z(), 5, 1e-6);
}

TEST(JoinMeasurement, RefusesToLoseTheDepth) {
  Vector3 point{0, 0, 100};
  const Vector3 before = point;
  Matrix3 covariance = Vector3(1, 1, 1e4).asDiagonal();
  StereoPixel pixel = kRobotCamera.project(point);
  pixel.z() = pixel.x() + 2;
  EXPECT_FALSE(join_measurement(kRobotCamera, pixel, 0.5, point, covariance));
  EXPECT_EQ(point, before);
}

TEST(Landmark, WarpsWithDepthAndRoll) {
  Landmark landmark;
  landmark.point = {0, 0, 10};
  landmark.anchor_depth = 10;
  landmark.R_anchor_keyframe = Matrix3::Identity();
  // Half the way there: everything looks twice as large.
  const vision::Warp near = landmark.warp(SE3{Matrix3::Identity(), {0, 0, -5}});
  EXPECT_FLOAT_EQ(near.a, 0.5);
  EXPECT_FLOAT_EQ(near.b, 0);
  // The camera rolls by 0.2 about z: T_camera_keyframe turns points back.
  const vision::Warp rolled = landmark.warp(SE3{so3_exp({0, 0, -0.2}), Vector3::Zero()});
  EXPECT_NEAR(rolled.a, std::cos(0.2), 1e-6);
  EXPECT_NEAR(rolled.c, std::sin(0.2), 1e-6);
}

}  // namespace
}  // namespace relmap::tracking
