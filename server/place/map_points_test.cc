#include "server/place/map_points.h"

#include <gtest/gtest.h>

#include "server/place/descriptor_match.h"
#include "server/place/testing/synthetic_street.h"

namespace relmap::place {
namespace {

TEST(AlongOdometry, GoesBothWaysAndPlacesFrames) {
  SyntheticStreet street(1, 12, 0);
  const auto frames = along_odometry(street.graph, {1, 6}, 3, 2);
  ASSERT_EQ(frames.size(), 6u);
  EXPECT_EQ(frames[0].frame, (FrameId{1, 6}));
  for (const PlacedFrame& placed : frames) {
    EXPECT_NEAR(placed.T_centre_frame.t.z(), 0.3 * (static_cast<double>(placed.frame.index) - 6), 1e-9);
    const double steps = std::abs(static_cast<double>(placed.frame.index) - 6);
    EXPECT_NEAR(placed.covariance(5, 5), 1e-6 * steps, 1e-12);
  }
  EXPECT_EQ(along_odometry(street.graph, {1, 0}, 3, 0).size(), 1u);
  EXPECT_TRUE(along_odometry(street.graph, {1, 99}, 3, 3).empty());
}

TEST(AlongOdometry, FollowsNeitherLoopsNorUnsensedMotion) {
  SyntheticStreet street(2, 12, 0);
  street.graph.add_edge({1, 0}, {1, 11}, 1);
  EXPECT_EQ(along_odometry(street.graph, {1, 0}, 5, 5).size(), 6u);
  street.graph.edit_hot({1, 5}).edges.front().source = MotionSource::kUnsensed;
  EXPECT_EQ(along_odometry(street.graph, {1, 6}, 5, 0).size(), 2u);
  EXPECT_EQ(along_odometry(street.graph, {1, 3}, 0, 5).size(), 2u);
}

TEST(GatherPoints, PointsHaveTheSamePositionWhicheverFrameSawThem) {
  SyntheticStreet street(3, 12, 0);
  const MapPoints map = gather_points(street.graph, {1, 6}, 3);
  EXPECT_EQ(map.frames.size(), 7u);
  ASSERT_GT(map.points.size(), 200u);
  std::size_t landmarks = 0;
  for (const MapPoint& p : map.points) {
    landmarks += p.landmark.valid();
    for (const MapPoint& q : map.points)
      if (p.landmark.valid() && p.landmark == q.landmark) {
        EXPECT_LT((p.point - q.point).norm(), 1e-3);
      }
  }
  EXPECT_GT(landmarks, map.points.size() / 3);
  EXPECT_LT(landmarks, map.points.size());
}

TEST(GatherPoints, SkipsFramesThatAreLeftOut) {
  SyntheticStreet street(4, 12, 0);
  const MapPoints map = gather_points(street.graph, {1, 6}, 3, [](FrameId frame) { return frame.index > 6; });
  for (const MapPoint& p : map.points) EXPECT_LE(map.frames[p.placed].frame.index, 6u);
  EXPECT_FALSE(map.points.empty());
}

TEST(GatherPoints, SkipsFramesWhosePoseIsUncertain) {
  SyntheticStreet street(4, 12, 0);
  street.graph.edit_hot({1, 8}).edges.front().covariance.diagonal().setConstant(1);
  const MapPoints map = gather_points(street.graph, {1, 6}, 3);
  for (const MapPoint& p : map.points) EXPECT_LT(map.frames[p.placed].frame.index, 8u);
  EXPECT_FALSE(map.points.empty());
}

TEST(StereoCovariance, EqualsThatOfRepeatedMeasurements) {
  const Vector3 truth(1.2, -0.4, 5);
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0, 0.2);
  Matrix3 sum = Matrix3::Zero();
  constexpr int kTrials = 20000;
  for (int i = 0; i < kTrials; ++i) {
    StereoPixel z = kStreetCamera.project(truth);
    for (int k = 0; k < 3; ++k) z[k] += noise(random);
    const Vector3 error = kStreetCamera.triangulate(z) - truth;
    sum += error * error.transpose() / kTrials;
  }
  const Matrix3 predicted = stereo_covariance(kStreetCamera, truth, 0.2);
  EXPECT_LT((sum - predicted).norm(), 0.05 * predicted.norm());
}

TEST(LevelOfScale, IsThatOfATrackedFeature) {
  EXPECT_EQ(level_of_scale(0), 0);
  EXPECT_EQ(level_of_scale(3.2f), 0);
  EXPECT_EQ(level_of_scale(5), 0);
  EXPECT_EQ(level_of_scale(10), 1);
  EXPECT_EQ(level_of_scale(40), 3);
  EXPECT_EQ(level_of_scale(1e6f), kMaxPyramidLevel);
  EXPECT_EQ(level_of_scale(NAN), 0);
}

TEST(MatchPoints, ViewsOfOnePointDoNotCompete) {
  Descriptor seen{}, other{};
  seen.fill(40);
  other.fill(40);
  for (int i = 0; i < 64; ++i) other[static_cast<std::size_t>(i)] = 80;
  AppearanceFeature feature;
  feature.descriptor = seen;
  feature.descriptor[0] = 44;
  Descriptor again = seen;
  again[1] = 41;
  const Matrix3 covariance = 1e-4 * Matrix3::Identity();
  std::vector<MapPoint> points{{Vector3(0, 0, 5), covariance, {{1, 1}, 0}, &seen, 0},
                               {Vector3(3, 0, 5), covariance, {{1, 1}, 0}, &again, 1},
                               {Vector3(0, 2, 5), covariance, {}, &other, 0}};
  EXPECT_EQ(match_points({&feature, 1}, points).size(), 1u) << "one landmark";
  points[1].landmark = {};
  EXPECT_TRUE(match_points({&feature, 1}, points).empty()) << "two things that look alike";
  points[1].point = {0.01, 0, 5};
  EXPECT_EQ(match_points({&feature, 1}, points).size(), 1u) << "one point by position";
}

TEST(GatherPoints, InTwoStepsGivesTheSamePointsAndTheCentresFirst) {
  const SyntheticStreet street(5, 12, 0.3);
  const MapPoints all = gather_points(street.graph, kStreetFrame, 3);
  MapPoints map = gather_centre(street.graph, kStreetFrame, 3);
  ASSERT_FALSE(map.points.empty());
  ASSERT_LT(map.points.size(), all.points.size());
  for (const MapPoint& point : map.points) EXPECT_EQ(map.frames[point.placed].frame, kStreetFrame);
  gather_rest(street.graph, map);
  ASSERT_EQ(map.points.size(), all.points.size());
  for (std::size_t p = 0; p < all.points.size(); ++p) {
    EXPECT_EQ(map.points[p].point, all.points[p].point);
    EXPECT_EQ(map.points[p].covariance, all.points[p].covariance);
    EXPECT_EQ(map.points[p].landmark, all.points[p].landmark);
    EXPECT_EQ(map.points[p].descriptor, all.points[p].descriptor);
    EXPECT_EQ(map.points[p].placed, all.points[p].placed);
  }
}

}  // namespace
}  // namespace relmap::place
