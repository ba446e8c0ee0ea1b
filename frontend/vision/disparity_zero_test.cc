#include "frontend/vision/disparity_zero.h"

#include <gtest/gtest.h>

#include <random>

#include "proto/geometry/geometry.h"

namespace relmap::vision {
namespace {

const StereoCamera kMovingRig{400, 320, 240, 0.12, 640, 480};

struct MovedScene {
  SE3 T_before_later;                    // of the left eye
  double off = 0;                        // pixels, added to all disparities
  double astray = 0;                     // share of the corners that move by themselves
  double min_depth = 3, max_depth = 20;  // metres
};

std::vector<MovedCorner> seen(const MovedScene& scene, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(20, 620), v(20, 460), inverse(1 / scene.max_depth, 1 / scene.min_depth),
      share(0, 1), far(-20, 20);
  std::normal_distribution<double> noise(0, 0.15);
  std::vector<MovedCorner> corners;
  for (int i = 0; i < 150; ++i) {
    const double left_u = u(random), left_v = v(random), z = 1 / inverse(random);
    const Vector3 p((left_u - kMovingRig.cx) / kMovingRig.f * z, (left_v - kMovingRig.cy) / kMovingRig.f * z, z);
    const StereoPixel later = kMovingRig.project(scene.T_before_later.inverse() * p);
    MovedCorner corner{left_u, left_v, kMovingRig.f * kMovingRig.baseline / z + scene.off + noise(random),
                       later.x() + noise(random), later.y() + noise(random)};
    if (share(random) < scene.astray) corner.u_later += far(random), corner.v_later += far(random);
    corners.push_back(corner);
  }
  return corners;
}

SE3 ahead(double metres, double turn = 0) { return {so3_exp(Vector3(0, turn, 0)), Vector3(0.03, 0, metres)}; }

TEST(DisparityZero, IsMeasuredWhicheverWayTheEyeIsTurned) {
  for (const double off : {-12.0, -7.0, -2.0, 0.0, 2.0, 7.0, 12.0})
    for (unsigned seed = 1; seed <= 5; ++seed) {
      const auto zero = disparity_zero(seen({ahead(0.3, 0.02), off}, seed), kMovingRig);
      ASSERT_TRUE(zero) << off;
      EXPECT_NEAR(zero->pixels, off, 4 * zero->sigma + 0.1);
      EXPECT_LT(zero->sigma, 0.5);
    }
}

TEST(DisparityZero, WhatMovesByItselfIsLeftOut) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const auto zero = disparity_zero(seen({ahead(0.3), 7, 0.4}, seed), kMovingRig);
    ASSERT_TRUE(zero);
    EXPECT_NEAR(zero->pixels, 7, 0.7);
    EXPECT_LT(zero->corners, 120);
  }
}

TEST(DisparityZero, TellsNothingWithoutATranslation) {
  EXPECT_FALSE(disparity_zero(seen({SE3()}, 1), kMovingRig)) << "it stands";
  SE3 turn;
  turn.R = so3_exp(Vector3(0, 0.05, 0.01));
  EXPECT_FALSE(disparity_zero(seen({turn}, 2), kMovingRig)) << "it turns";
}

TEST(DisparityZero, TellsNothingWhereAllIsEquallyFarAway) {
  MovedScene wall{ahead(0.02)};
  wall.min_depth = 19.9;
  EXPECT_FALSE(disparity_zero(seen(wall, 1), kMovingRig));
}

TEST(DisparityZero, TellsNothingOfFewCornersOrOfMotionsThatDisagree) {
  auto corners = seen({ahead(0.3)}, 1);
  EXPECT_FALSE(disparity_zero(seen({ahead(0.3), 0, 1}, 1), kMovingRig));
  corners.resize(25);
  EXPECT_FALSE(disparity_zero(corners, kMovingRig));
  EXPECT_FALSE(disparity_zero({}, kMovingRig));
}

}  // namespace
}  // namespace relmap::vision
