#include "frontend/vision/focal_length.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

namespace relmap {
namespace {

constexpr StereoCamera kCamera{640, 319.5, 239.5, 0, 640, 480};
const SE3 kPose = SE3::exp((Vector6() << 0.4, -0.1, 0.8, 0.05, -0.2, 0.03).finished());

// What a camera of focal length `f` at kPose sees; `wrong` of them anywhere in the picture.
std::vector<Correspondence> scene(std::uint64_t seed, double f, int count, int wrong, double noise,
                                  double depth_from = 3, double depth_to = 15) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(20, 620), v(20, 460), depth(depth_from, depth_to);
  std::normal_distribution<double> normal(0, noise);
  StereoCamera camera = kCamera;
  camera.f = f;
  std::vector<Correspondence> result;
  for (int i = 0; i < count; ++i) {
    const double z = depth(random);
    const Vector3 in_camera((u(random) - camera.cx) / f * z, (v(random) - camera.cy) / f * z, z);
    const StereoPixel pixel = camera.project(in_camera);
    result.push_back({kPose * in_camera, {pixel.x() + normal(random), pixel.y() + normal(random), kNoRight}, 1});
  }
  for (int i = 0; i < wrong; ++i) result[static_cast<std::size_t>(i)].pixel = {u(random), v(random), kNoRight};
  return result;
}

MotionOptions options() {
  MotionOptions options;
  options.min_inliers = 20;
  return options;
}

TEST(FocalLength, IsFoundWithThePoseAmongWrongMatches) {
  for (const double f : {350.0, 640.0, 1100.0, 1900.0}) {
    const auto found = estimate_motion_and_focal_length(scene(1, f, 150, 60, 0.5), kCamera, options());
    ASSERT_TRUE(found.ok()) << f << ": " << found.status().to_string();
    EXPECT_NEAR(found->f / f, 1, 0.03);
    EXPECT_LT(std::abs(std::log(found->f / f)), 4 * found->sigma_log_f + 1e-3);
    EXPECT_GE(found->motion.inliers.size(), 80u);
    EXPECT_LT((kPose.inverse() * found->motion.T_reference_camera).t.norm(), 0.3) << f;
  }
}

TEST(FocalLength, TheCovarianceHoldsItsUncertainty) {
  double nees = 0;
  constexpr int kTrials = 30;
  for (int i = 0; i < kTrials; ++i) {
    const auto found =
        estimate_motion_and_focal_length(scene(100 + static_cast<std::uint64_t>(i), 700, 80, 0, 1), kCamera, options());
    ASSERT_TRUE(found.ok()) << found.status().to_string();
    const Vector6 error = (kPose.inverse() * found->motion.T_reference_camera).log();
    nees += error.dot(found->motion.covariance.ldlt().solve(error)) / kTrials;
  }
  EXPECT_GT(nees, 4.0);
  EXPECT_LT(nees, 8.5);
}

TEST(FocalLength, CannotBeToldFromAWallSeenFromTheFront) {
  const auto found = estimate_motion_and_focal_length(scene(3, 700, 100, 0, 1, 8, 8.0001), kCamera, options());
  EXPECT_EQ(found.reason(), Reason::NO_CALIBRATION) << found.status().to_string();
}

TEST(FocalLength, WhatAgreesWithNoneIsRefused) {
  EXPECT_EQ(estimate_motion_and_focal_length(scene(4, 700, 120, 120, 1), kCamera, options()).reason(),
            Reason::TOO_FEW_INLIERS);
  EXPECT_EQ(estimate_motion_and_focal_length({}, kCamera, options()).reason(), Reason::TOO_FEW_INLIERS);
}

TEST(FocalLength, TheSameInputGivesTheSameAnswer) {
  const auto points = scene(5, 800, 100, 30, 1);
  const auto a = estimate_motion_and_focal_length(points, kCamera, options());
  const auto b = estimate_motion_and_focal_length(points, kCamera, options());
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->f, b->f);
  EXPECT_EQ(a->motion.T_reference_camera.t, b->motion.T_reference_camera.t);
}

}  // namespace
}  // namespace relmap
