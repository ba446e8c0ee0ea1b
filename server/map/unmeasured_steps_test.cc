#include "server/map/unmeasured_steps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/map/derived.h"
#include "server/map/testing/points_drive.h"
#include "storage/unmeasured.h"

namespace relmap {
namespace {

// Laps so short that closures bind across the step that nothing measured, and become no edges.
constexpr std::uint32_t kLap = 12, kBlind = 18, kFrames = 40;

sim::PointsWorldOptions small_laps() {
  sim::PointsWorldOptions options;
  options.frames = kFrames;
  options.frames_per_lap = kLap;
  options.births = 30;
  return options;
}

// A drive that loses sight of everything before frame kBlind, and guesses `wrong` in front of the step there.
class UnmeasuredStep : public ::testing::TestWithParam<std::uint64_t> {
 protected:
  void drive(const SE3& wrong) {
    drive_.apply(session_record(world_));
    for (std::uint32_t i = 0; i < kFrames; ++i) {
      Keyframe keyframe = world_.keyframe(i);
      if (i == kBlind) {
        keyframe.source = MotionSource::kConstantVelocity;
        keyframe.step_covariance = 100 * Matrix6::Identity();
      }
      if (i >= kBlind) {
        keyframe.T_odom_frame =
            world_.T_odom_frame(kBlind - 1) * wrong * world_.T_odom_frame(kBlind - 1).inverse() * keyframe.T_odom_frame;
        for (std::size_t n = 0; n < keyframe.tracks.size(); ++n)
          if (TrackId& track = keyframe.tracks[n].track; track.sequence < kBlind)
            track = {kBlind, 10000 + 1000 * track.sequence + track.index};
      }
      Bytes payload = encode_keyframe(keyframe);
      const std::uint32_t crc = crc32c(payload);
      drive_.apply(KeyframeRecord{kDriveSession, crc, std::move(payload)});
    }
  }
  void propose(std::uint32_t query) { drive_.apply(*true_closure(drive_.map(), world_, query, kLap)); }

  Edge step() { return *find_edge(drive_.map(), {{kDriveSession, kBlind}, 0}); }
  SE3 truth(std::uint32_t a, std::uint32_t b) { return world_.T_world_frame(a).inverse() * world_.T_world_frame(b); }
  double metres_off() { return (step().T_ab.t - truth(kBlind - 1, kBlind).t).norm(); }

  const sim::PointsWorld world_{small_laps()};
  PointsDrive drive_;
};

SE3 guess(std::uint64_t seed) {
  // Up to 4 m and 2 radians, in all directions.
  const double turn = 2.4 * static_cast<double>(seed);
  Vector6 xi;
  xi << 4 * std::cos(turn), 1.5 * std::sin(3 * turn), 4 * std::sin(turn), 0.5 * std::cos(2 * turn),
      2 * std::sin(1.7 * turn), 0.5 * std::sin(2 * turn);
  return SE3::exp(xi);
}

TEST_P(UnmeasuredStep, IsWhatTheClosuresAcrossItMeasured) {
  drive(guess(GetParam()));
  ASSERT_TRUE(is_unmeasured(step()));
  EXPECT_GT(metres_off(), 1);
  for (std::uint32_t query = kBlind + 2; query < kBlind + 10; query += 2) propose(query);
  ASSERT_EQ(drive_.map().state().closures_accepted, 4u);
  EXPECT_FALSE(is_unmeasured(step()));
  EXPECT_LT(metres_off(), 0.05);
  EXPECT_THAT(derived_differences(drive_.map()), testing::IsEmpty());
}

TEST_P(UnmeasuredStep, IsTheGuessAgainWithoutThem) {
  drive(guess(GetParam()));
  const SE3 before = step().T_ab;
  for (const std::uint32_t query : {kBlind + 2, kBlind + 4}) propose(query);
  ASSERT_LT(metres_off(), 0.1);
  drive_.apply(SetEdgeStateRecord{{{kDriveSession, kBlind + 2}, 1}, EdgeState::kRemoved, "that is another room"});
  ASSERT_EQ(drive_.map().state().closures_accepted, 0u);
  EXPECT_TRUE(is_unmeasured(step()));
  EXPECT_LT((before.inverse() * step().T_ab).log().norm(), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Guesses, UnmeasuredStep, ::testing::Range(std::uint64_t{0}, std::uint64_t{12}));

}  // namespace
}  // namespace relmap
