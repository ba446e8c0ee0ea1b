// Two laps of a simulated drive, with the closures that a test proposes. For tests.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/map/derived.h"
#include "server/map/testing/points_drive.h"

namespace relmap::map {

inline constexpr std::uint32_t kLap = 60, kBlind = 30;

inline sim::PointsWorldOptions two_laps() {
  sim::PointsWorldOptions options;
  options.frames = 90;
  options.frames_per_lap = kLap;
  options.births = 30;
  return options;
}

// No sensor measured the step to frame kBlind, so on the second lap only other closures can confirm a closure.
class TwoLaps : public ::testing::Test {
 protected:
  void SetUp() override {
    drive_.apply(session_record(world_));
    for (std::uint32_t i = 0; i < world_.options().frames; ++i) {
      Keyframe keyframe = world_.keyframe(i);
      if (i == kBlind) {
        keyframe.source = MotionSource::kUnsensed;
        keyframe.step_covariance = 25 * Matrix6::Identity();
      }
      Bytes payload = encode_keyframe(keyframe);
      const std::uint32_t crc = crc32c(payload);
      drive_.apply(storage::KeyframeRecord{kDriveSession, crc, std::move(payload)});
    }
  }

  void propose(std::uint32_t query) { drive_.apply(*true_closure(drive_.map(), world_, query, kLap)); }
  // Proposes a closure with the place a metre further on.
  void propose_wrongly(std::uint32_t query) { drive_.apply(wrong_closure(query)); }
  storage::ClosureProposalRecord wrong_closure(std::uint32_t query) {
    auto wrong = *true_closure(drive_.map(), world_, query, kLap);
    wrong.match.index += 5;
    return wrong;
  }
  storage::Edge closure(std::uint32_t query) { return drive_.map().hot({kDriveSession, query})->edges.back(); }
  storage::EdgeState state(std::uint32_t query) { return closure(query).state; }

  void expect_derived_facts_hold() { EXPECT_THAT(derived_differences(drive_.map()), ::testing::IsEmpty()); }

  const sim::PointsWorld world_{two_laps()};
  PointsDrive drive_;
};

}  // namespace relmap::map
