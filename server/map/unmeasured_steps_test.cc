#include "server/map/unmeasured_steps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/map/derived.h"
#include "server/map/testing/points_drive.h"
#include "storage/graph/frame.h"

namespace relmap::map {
namespace {

// Laps so short that closures bind across a step that nothing measured, and become no edges; and so long that they do.
constexpr std::uint32_t kShortLap = 12, kLongLap = 24;

// Up to 4 m and 2 radians, in all directions.
SE3 mistake(std::uint64_t seed) {
  const double turn = 2.4 * static_cast<double>(seed);
  Vector6 xi;
  xi << 4 * std::cos(turn), 1.5 * std::sin(3 * turn), 4 * std::sin(turn), 0.5 * std::cos(2 * turn),
      2 * std::sin(1.7 * turn), 0.5 * std::sin(2 * turn);
  return SE3::exp(xi);
}

sim::PointsWorldOptions laps_of(std::uint32_t lap) {
  sim::PointsWorldOptions options;
  options.frames = 2 * lap + 24;
  options.frames_per_lap = lap;
  options.births = 30;
  return options;
}

// A drive that loses sight of everything before each frame of `blind`, and guesses the step there.
class BlindDrive {
 public:
  BlindDrive(std::uint32_t lap, std::vector<std::uint32_t> blind, const SE3& wrong, double sigma = 10)
      : world_(laps_of(lap)), lap_(lap) {
    drive_.apply(session_record(world_));
    SE3 T_odom_truth;
    for (std::uint32_t i = 0; i < world_.size(); ++i) {
      Keyframe keyframe = world_.keyframe(i);
      const auto lost = std::upper_bound(blind.begin(), blind.end(), i);  // the one behind the last that it has met
      if (std::find(blind.begin(), blind.end(), i) != blind.end()) {
        keyframe.source = MotionSource::kConstantVelocity;
        keyframe.step_covariance = sigma * sigma * Matrix6::Identity();
        const SE3 before = world_.T_odom_frame(i - 1);
        T_odom_truth = T_odom_truth * before * wrong * before.inverse();
      }
      keyframe.T_odom_frame = T_odom_truth * keyframe.T_odom_frame;
      if (lost != blind.begin())
        for (TrackMeasurement& seen : keyframe.tracks)
          if (const std::uint32_t since = *(lost - 1); seen.track.sequence < since)
            seen.track = {since, 10000 + 1000 * seen.track.sequence + seen.track.index};
      Bytes payload = encode_keyframe(keyframe);
      const std::uint32_t crc = crc32c(payload);
      drive_.apply(storage::KeyframeRecord{kDriveSession, crc, std::move(payload)});
    }
  }

  PointsDrive& drive() { return drive_; }
  storage::Map& map() { return drive_.map(); }
  void propose(std::uint32_t query) { drive_.apply(*true_closure(map(), world_, query, lap_)); }
  EdgeId closure(std::uint32_t query) const { return {{kDriveSession, query}, 1}; }

  storage::Edge step(std::uint32_t i) { return *storage::find_edge(map(), {{kDriveSession, i}, 0}); }
  double metres_off(std::uint32_t i) {
    const SE3 truth = world_.T_world_frame(i - 1).inverse() * world_.T_world_frame(i);
    return (step(i).T_ab.t - truth.t).norm();
  }

 private:
  const sim::PointsWorld world_;
  const std::uint32_t lap_;
  PointsDrive drive_;
};

constexpr std::uint32_t kGuessed = 18;  // the step to this frame is a guess

class UnmeasuredStep : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(UnmeasuredStep, IsMeasuredByTheClosuresAcrossIt) {
  BlindDrive drive(kShortLap, {kGuessed}, mistake(GetParam()));
  ASSERT_TRUE(storage::is_unmeasured(drive.step(kGuessed)));
  EXPECT_GT(drive.metres_off(kGuessed), 1);
  for (std::uint32_t query = kGuessed + 2; query < kGuessed + 10; query += 2) drive.propose(query);
  ASSERT_EQ(drive.map().state().closures_accepted, 4u);
  EXPECT_FALSE(storage::is_unmeasured(drive.step(kGuessed)));
  EXPECT_LT(drive.metres_off(kGuessed), 0.05);
  EXPECT_THAT(derived_differences(drive.map()), testing::IsEmpty());
}

TEST_P(UnmeasuredStep, IsTheGuessAgainWhenTheyAreRemoved) {
  BlindDrive drive(kShortLap, {kGuessed}, mistake(GetParam()));
  const storage::Edge before = drive.step(kGuessed);
  for (const std::uint32_t query : {kGuessed + 2, kGuessed + 4}) drive.propose(query);
  ASSERT_LT(drive.metres_off(kGuessed), 0.1);
  drive.drive().apply(
      storage::SetEdgeStateRecord{drive.closure(kGuessed + 2), storage::EdgeState::kRemoved, "that is another room"});
  ASSERT_EQ(drive.map().state().closures_accepted, 0u);
  const storage::Edge after = drive.step(kGuessed);
  EXPECT_TRUE(storage::is_unmeasured(after));
  EXPECT_LT((before.T_ab.inverse() * after.T_ab).log().norm(), 1e-9);
  EXPECT_EQ(after.covariance, after.prior_covariance) << "as badly known";
  EXPECT_EQ(after.correlation_with_previous, storage::Edge().correlation_with_previous);
  EXPECT_EQ(drive.step(kGuessed + 1).correlation_with_previous, storage::Edge().correlation_with_previous);
}

INSTANTIATE_TEST_SUITE_P(Guesses, UnmeasuredStep, ::testing::Range(std::uint64_t{0}, std::uint64_t{12}));

TEST(UnmeasuredSteps, AreEachMeasuredByAnotherClosure) {
  constexpr std::uint32_t kAgain = kGuessed + 5;
  BlindDrive drive(kShortLap, {kGuessed, kAgain}, mistake(3));
  // The first two come into force together: one leads across the first step, the other across both.
  for (const std::uint32_t query : {kGuessed + 2, kAgain + 2, kGuessed + 4, kAgain + 4}) drive.propose(query);
  ASSERT_EQ(drive.map().state().closures_accepted, 4u);
  EXPECT_LT(drive.metres_off(kGuessed), 0.1);
  EXPECT_LT(drive.metres_off(kAgain), 0.1);
}

TEST(UnmeasuredSteps, AreNotSetByClosuresThatAreEdges) {
  BlindDrive drive(kLongLap, {kLongLap + 6}, mistake(5));
  const storage::Edge before = drive.step(kLongLap + 6);
  for (const std::uint32_t query : {kLongLap + 8, kLongLap + 10}) drive.propose(query);
  ASSERT_TRUE(storage::find_edge(drive.map(), drive.closure(kLongLap + 8))->in_graph());
  EXPECT_LT((before.T_ab.inverse() * drive.step(kLongLap + 6).T_ab).log().norm(), 1e-9)
      << "landmarks are reached over the edge, and nothing would refine the step";
}

TEST(UnmeasuredSteps, AreNotSetAgainstAnAccurateGuess) {
  // The closures are a metre off, and the guess is known to centimetres: they are not believed of it.
  BlindDrive drive(kShortLap, {kGuessed}, mistake(5), 0.05);
  const storage::Edge before = drive.step(kGuessed);
  for (const std::uint32_t query : {kGuessed + 2, kGuessed + 4}) drive.propose(query);
  EXPECT_EQ(drive.map().state().closures_accepted, 0u) << "they contradict the motion";
  EXPECT_LT((before.T_ab.inverse() * drive.step(kGuessed).T_ab).log().norm(), 1e-9);
}

TEST(UnmeasuredSteps, OfFrozenSessionsAreNotSet) {
  BlindDrive drive(kShortLap, {kGuessed}, mistake(7));
  const storage::Edge before = drive.step(kGuessed);
  drive.drive().apply(storage::SetSessionStateRecord{kDriveSession, storage::SessionState::kFrozen});
  for (const std::uint32_t query : {kGuessed + 2, kGuessed + 4}) drive.propose(query);
  ASSERT_EQ(drive.map().state().closures_accepted, 2u);
  EXPECT_LT((before.T_ab.inverse() * drive.step(kGuessed).T_ab).log().norm(), 1e-9);
}

}  // namespace
}  // namespace relmap::map
