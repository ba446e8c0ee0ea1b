#include "frontend/tracking/drift.h"

#include <gtest/gtest.h>

#include <vector>

namespace relmap::tracking {
namespace {

TEST(Drift, DoesNotDependOnTheWorldFrame) {
  const SE3 elsewhere{so3_exp({0.3, -0.2, 1.0}), {5, 6, 7}};
  std::vector<PosePair> poses;
  for (int i = 0; i < 50; ++i) {
    const SE3 truth{so3_exp({0, 0.02 * i, 0}), {0.1 * i, 0, 1.0 * i}};
    poses.push_back({truth, elsewhere * truth});
  }
  const Drift drift = measure_drift(poses, 20);
  EXPECT_NEAR(drift.translation, 0, 1e-12);
  EXPECT_NEAR(drift.rotation, 0, 1e-7);
  EXPECT_GT(drift.segments, 25u);
}

TEST(Drift, OfAStretchedChainIsTheStretch) {
  std::vector<PosePair> poses;
  for (int i = 0; i <= 40; ++i)
    poses.push_back({{Matrix3::Identity(), {0, 0, 1.0 * i}}, {Matrix3::Identity(), {0, 0, 1.02 * i}}});
  const Drift drift = measure_drift(poses, 30);
  EXPECT_EQ(drift.segments, 11u);
  EXPECT_NEAR(drift.translation, 0.02, 1e-9);
  EXPECT_EQ(measure_drift(poses, 41).segments, 0u);
}

TEST(Drift, CountsRotationByTheMetre) {
  std::vector<PosePair> poses;
  for (int i = 0; i <= 20; ++i)
    poses.push_back({{Matrix3::Identity(), {0, 0, 1.0 * i}}, {so3_exp({0, 0.001 * i, 0}), {0, 0, 1.0 * i}}});
  EXPECT_NEAR(measure_drift(poses, 10).rotation, 0.001, 1e-6);
}

}  // namespace
}  // namespace relmap::tracking
