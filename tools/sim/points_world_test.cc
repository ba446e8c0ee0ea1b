#include "tools/sim/points_world.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

namespace relmap::sim {
namespace {

TEST(PointsWorld, Figure8HasTheSizeOfThePublishedSimulation) {
  const PointsWorld world(figure8_options(1));
  std::set<PointId> points;
  std::set<std::pair<std::uint32_t, std::uint32_t>> tracks;
  std::size_t observations = 0;
  for (std::uint32_t i = 0; i < world.size(); ++i) {
    const Keyframe keyframe = world.keyframe(i);
    observations += keyframe.tracks.size();
    for (const auto& m : keyframe.tracks) {
      EXPECT_FALSE(std::isnan(m.u_right));
      tracks.insert({m.track.sequence, m.track.index});
    }
    for (const PointId id : world.landmarks(i)) points.insert(id);
  }
  EXPECT_EQ(world.size(), 288U);
  EXPECT_NEAR(static_cast<double>(observations), 12591, 250);
  EXPECT_NEAR(static_cast<double>(tracks.size()), 3207, 100);
  EXPECT_NEAR(static_cast<double>(observations) / static_cast<double>(tracks.size()), 3.9, 0.1);
  EXPECT_LT(points.size(), tracks.size());
}

TEST(PointsWorld, Figure8SeesTheFirstFramesAgainInTheLast) {
  const PointsWorld world(figure8_options(1));
  for (std::uint32_t k = 0; k < 12; ++k) {
    const auto first = world.landmarks(k), again = world.landmarks(276 + k);
    const std::set<PointId> known(first.begin(), first.end());
    const auto common = std::count_if(again.begin(), again.end(), [&](PointId id) { return known.count(id) > 0; });
    EXPECT_GE(common, 20) << k;
    EXPECT_LT((world.T_world_frame(k).t - world.T_world_frame(276 + k).t).norm(), 0.15);
  }
}

TEST(PointsWorld, TracksNameTheKeyframeAndIndexThatIntroducedThem) {
  PointsWorldOptions options;
  options.frames = 130;
  options.frames_per_lap = 60;
  options.lateral_per_lap = 0.3;
  const PointsWorld world(options);
  std::map<std::pair<std::uint32_t, std::uint32_t>, PointId> known;
  for (std::uint32_t i = 0; i < world.size(); ++i) {
    const Keyframe keyframe = world.keyframe(i);
    const auto points = world.landmarks(i);
    ASSERT_EQ(points.size(), keyframe.tracks.size());
    for (std::uint32_t k = 0; k < points.size(); ++k) {
      const TrackId track = keyframe.tracks[k].track;
      const auto key = std::make_pair(track.sequence, track.index);
      const auto at = known.find(key);
      if (at == known.end()) {
        EXPECT_EQ(track, (TrackId{i, k}));
        known.emplace(key, points[k]);
      } else {
        EXPECT_EQ(at->second, points[k]);
      }
    }
  }
}

TEST(PointsWorld, MeasurementsScatterAboutTheTruthByOnePixel) {
  const PointsWorld world(figure8_options(3));
  double squares = 0;
  int terms = 0;
  for (std::uint32_t i = 0; i < world.size(); i += 7) {
    const Keyframe keyframe = world.keyframe(i);
    const auto points = world.landmarks(i);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Vector3 p = world.T_world_frame(i).inverse() * world.point(points[k]);
      squares += (keyframe.tracks[k].pixel() - world.options().camera.project(p)).squaredNorm();
      terms += 3;
    }
  }
  EXPECT_NEAR(std::sqrt(squares / terms), 1, 0.05);
}

TEST(PointsWorld, SeedsChangeNoiseOnlyAndOrderChangesNothing) {
  const PointsWorld a(figure8_options(1)), b(figure8_options(2));
  EXPECT_EQ(a.landmarks(100), b.landmarks(100));
  const Keyframe a100 = a.keyframe(100), b100 = b.keyframe(100);
  EXPECT_NE(a100.tracks[0].u_left, b100.tracks[0].u_left);
  a.keyframe(5);
  const Keyframe again = a.keyframe(100);
  EXPECT_EQ(again.tracks[0].u_left, a100.tracks[0].u_left);
  EXPECT_EQ(again.T_odom_frame.t, a100.T_odom_frame.t);
}

TEST(PointsWorld, OdometryDriftsByItsStepNoise) {
  const PointsWorld world(figure8_options(4));
  double squares = 0;
  for (std::uint32_t i = 1; i < world.size(); ++i) {
    const SE3 truth = world.T_world_frame(i - 1).inverse() * world.T_world_frame(i);
    const SE3 step = world.T_odom_frame(i - 1).inverse() * world.T_odom_frame(i);
    squares += (truth.inverse() * step).log().head<3>().squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(squares / 3 / (world.size() - 1)), 0.01, 0.001);
}

TEST(PointsWorld, EveryKeyframeOfALongDrivePassesTheServersChecks) {
  PointsWorldOptions options;
  options.shape = PlanShape::kRoundedRectangle;
  options.frames = 200000;
  options.frames_per_lap = 5000;
  options.appearance = 300;
  options.depth_max = 40;
  options.mono_share = 0.1;
  const PointsWorld world(options);
  for (const std::uint32_t i : {0U, 1U, 4999U, 5000U, 123456U, 199999U}) {
    const Keyframe keyframe = world.keyframe(i);
    const Status status = check_keyframe(keyframe);
    EXPECT_TRUE(status.ok()) << status.to_string();
    EXPECT_EQ(keyframe.appearance.size(), 300U);
    EXPECT_NEAR(static_cast<double>(encode_keyframe(keyframe).size()), 46000, 3000);
  }
}

TEST(PointsWorld, DescriptorsLookLikeSiftAndAreRecognisedOnTheNextLap) {
  PointsWorldOptions options;
  options.frames = 130;
  options.frames_per_lap = 60;
  options.appearance = 200;
  const PointsWorld world(options);
  const Keyframe first = world.keyframe(30), again = world.keyframe(90);
  int found = 0;
  for (const auto& f : first.appearance) {
    double norm = 0;
    for (const auto entry : f.descriptor) norm += double(entry) * entry;
    EXPECT_NEAR(std::sqrt(norm), 512, 40);
    for (const auto& g : again.appearance) {
      double distance = 0;
      for (int k = 0; k < 128; ++k) distance += std::pow(double(f.descriptor[k]) - g.descriptor[k], 2);
      if (std::sqrt(distance) < 100) ++found;
    }
  }
  EXPECT_GT(found, 80);
  EXPECT_LT(found, 190);
}

}  // namespace
}  // namespace relmap::sim
