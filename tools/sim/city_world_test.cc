#include "tools/sim/city_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <vector>

namespace relmap::sim {
namespace {

CityWorldOptions small_town() {
  CityWorldOptions options;
  options.plan.columns = options.plan.rows = 3;
  return options;
}

CityDriveOptions drive_of(std::uint32_t frames) {
  CityDriveOptions options;
  options.frames = frames;
  options.ride_every = 400;
  return options;
}

SessionHeader header(const CityWorld& world) {
  SessionHeader session;
  session.uuid.bytes[0] = 1;
  session.robot = session.name = "robot";
  session.camera = world.options().camera;
  return session;
}

TEST(CityPlan, HasTwentyKilometresOfStreets) { EXPECT_GT(CityPlan({}).street_metres(), 20'000); }

TEST(CityPlan, PiecesMeetAtCrossings) {
  const CityPlan plan({});
  for (PieceId id = 0; id < 4 * plan.crossings(); ++id) {
    const auto piece = plan.piece(id);
    if (!piece) continue;
    for (const int turn : {-1, 0, 1})
      if (const auto next = plan.next(id, turn)) {
        const Vector2 centre = piece->at(piece->length + kHalfStreet, 0);
        EXPECT_LT((next->begin - kHalfStreet * next->direction - centre).norm(), 1e-9);
        EXPECT_NEAR(next->direction.dot(piece->right()), turn, 1e-12);
      }
  }
}

TEST(CityDriveTest, GoesStepByStepWithoutABreakButForRides) {
  const CityPlan plan(small_town().plan);
  const CityDrive drive(plan, drive_of(4000));
  std::set<std::uint32_t> rides;
  for (std::uint32_t i = 1; i < drive.size(); ++i) {
    const auto before = drive.at(i - 1), here = drive.at(i);
    if (here.ride != 0) rides.insert(here.ride);
    if (before.running || here.running) {
      EXPECT_EQ(here.ride, before.ride) << i;
      EXPECT_NEAR(here.in_cabin, before.in_cabin, 1e-9) << i;
      continue;
    }
    const double moved = std::hypot(here.pose.x - before.pose.x, here.pose.z - before.pose.z);
    EXPECT_NEAR(moved, drive.options().step, 0.02) << i;
    EXPECT_LT(std::abs(std::remainder(here.pose.yaw - before.pose.yaw, 6.283185307)), 0.12) << i;
    if (here.ride != 0 && before.ride != 0) {
      EXPECT_NEAR(here.in_cabin - before.in_cabin, drive.options().step, 1e-9) << i;
    }
  }
  EXPECT_GE(rides.size(), 3u);
  EXPECT_NEAR(drive.metres_driven(drive.size() - 1), 0.5 * (drive.size() - drive.frames_on_trains(drive.size() - 1)),
              0.5 * (rides.size() + 2.0));
}

TEST(CityRobotTest, SeesAsMuchAsARealOne) {
  const CityWorld world(small_town());
  CityRobot robot(world, drive_of(600), header(world));
  std::size_t tracks = 0, appearance = 0, continued = 0, poor = 0;
  for (std::uint32_t i = 0; i < 600; ++i) {
    const Keyframe keyframe = robot.next();
    tracks += keyframe.tracks.size();
    appearance += keyframe.appearance.size();
    poor += keyframe.tracks.size() < 60;
    for (const TrackMeasurement& z : keyframe.tracks) continued += z.track.sequence < i;
    ASSERT_TRUE(decode_keyframe(encode_keyframe(keyframe)).ok()) << i;
  }
  EXPECT_GT(tracks, 600 * 95u);
  EXPECT_GT(appearance, 600 * 250u);
  EXPECT_GT(continued, tracks / 2);
  EXPECT_LT(poor, 40u) << "where it turns";
}

// A track's measurements are those of one point, also in a cabin and through its door.
TEST(CityRobotTest, TracksAreOfPointsThatStandStill) {
  CityWorldOptions options = small_town();
  options.pixel_noise = 0.01;
  options.step_noise_m = options.step_noise_rad = 1e-9;
  const CityWorld world(options);
  CityRobot robot(world, drive_of(2500), header(world));
  std::map<TrackId, Vector3> in_odometry;
  std::size_t compared = 0, rides = 0;
  for (std::uint32_t i = 0; i < 2500; ++i) {
    const Keyframe keyframe = robot.next();
    rides += robot.drive().at(i).running;
    for (const TrackMeasurement& z : keyframe.tracks) {
      if (z.pixel().x() - z.pixel().z() < 16) continue;  // nearer than 11 m, where the noise is a centimetre
      const Vector3 p = keyframe.T_odom_frame * options.camera.triangulate(z.pixel());
      const auto [known, fresh] = in_odometry.emplace(z.track, p);
      EXPECT_EQ(fresh, z.track.sequence == i || in_odometry.at(z.track) == p);
      EXPECT_LT((known->second - p).norm(), 0.1) << i;
      compared += !fresh;
    }
  }
  EXPECT_GT(compared, 20'000u);
  EXPECT_GT(rides, 20u);
}

// Also if fewer points are tracked than are seen.
TEST(CityRobotTest, BeginsAnywhereWithTheSameKeyframes) {
  CityWorldOptions options = small_town();
  options.tracks = 60;
  const CityWorld world(options);
  CityRobot whole(world, drive_of(1200), header(world));
  std::map<std::uint32_t, Bytes> expected;
  for (std::uint32_t i = 0; i < 1200; ++i) expected[i] = encode_keyframe(whole.next());
  for (std::uint32_t first = 1; first < 1190; first += 37) {
    CityRobot later(world, drive_of(1200), header(world), first);
    for (std::uint32_t i = first; i < first + 10; ++i) ASSERT_EQ(encode_keyframe(later.next()), expected[i]) << i;
  }
}

TEST(CityRobotTest, APassSeesMuchOfWhatAnotherSaw) {
  const CityWorldOptions options = small_town();
  const CityWorld world(options);
  std::vector<std::pair<SE3, std::set<std::pair<int, int>>>> seen;
  CityRobot robot(world, drive_of(3000), header(world));
  // Points are told by their descriptors without noise: here by the places that they have in the world.
  std::size_t revisits = 0, alike = 0;
  std::vector<Keyframe> keyframes;
  for (std::uint32_t i = 0; i < 3000; ++i) keyframes.push_back(robot.next());
  const auto places = [&](std::uint32_t i) {
    std::set<std::tuple<int, int, int>> at;
    for (const TrackMeasurement& z : keyframes[i].tracks)
      if (z.pixel().x() - z.pixel().z() > 8) {
        const Vector3 p = robot.T_world_frame(i) * options.camera.triangulate(z.pixel());
        at.emplace(std::lround(p.x()), std::lround(p.y()), std::lround(p.z()));
      }
    return at;
  };
  for (std::uint32_t i = 1100; i < 3000; i += 10)
    for (std::uint32_t k = 0; k + 1024 < i; ++k) {
      const SE3 T = robot.T_world_frame(k).inverse() * robot.T_world_frame(i);
      if (T.t.norm() > 1 || rotation_angle(T.R) > 0.1 || robot.drive().at(i).ride || robot.drive().at(k).ride) continue;
      const auto then = places(k), now = places(i);
      std::size_t both = 0;
      for (const auto& p : now) both += then.contains(p);
      ++revisits;
      alike += both > 15;
      break;
    }
  ASSERT_GT(revisits, 20u);
  EXPECT_GT(alike, 0.8 * static_cast<double>(revisits));
}

}  // namespace
}  // namespace relmap::sim
