#include "server/map/closures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/map/derived.h"
#include "server/map/testing/points_drive.h"

namespace relmap {
namespace {

constexpr std::uint32_t kLap = 60, kBlind = 30;

sim::PointsWorldOptions two_laps() {
  sim::PointsWorldOptions options;
  options.frames = 90;
  options.frames_per_lap = kLap;
  options.births = 30;
  return options;
}

// Two laps. Nothing sensed the step to frame kBlind, so that on the second lap only closures can speak of closures.
class Closures : public ::testing::Test {
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
      drive_.apply(KeyframeRecord{kDriveSession, crc, std::move(payload)});
    }
  }

  void propose(std::uint32_t query) { drive_.apply(*true_closure(drive_.map(), world_, query, kLap)); }
  // As if the place looked like the one a metre further on.
  void propose_wrongly(std::uint32_t query) {
    auto wrong = *true_closure(drive_.map(), world_, query, kLap);
    wrong.match.index += 5;
    drive_.apply(wrong);
  }
  Edge closure(std::uint32_t query) { return drive_.map().hot({kDriveSession, query})->edges.back(); }
  EdgeState state(std::uint32_t query) { return closure(query).state; }

  void expect_derived_facts_hold() { EXPECT_THAT(derived_differences(drive_.map()), testing::IsEmpty()); }

  const sim::PointsWorld world_{two_laps()};
  PointsDrive drive_;
};

TEST_F(Closures, TwoThatAgreeComeIntoForce) {
  propose(62);
  EXPECT_EQ(closure(62).reason, Reason::LONE);
  propose(64);
  EXPECT_EQ(state(62), EdgeState::kAccepted);
  EXPECT_EQ(state(64), EdgeState::kAccepted);
  expect_derived_facts_hold();
}

TEST_F(Closures, OneThatAnAcceptedSetContradictsStaysACandidate) {
  for (const std::uint32_t query : {62, 64, 66}) propose(query);
  propose_wrongly(68);
  EXPECT_EQ(state(68), EdgeState::kCandidate);
  EXPECT_EQ(closure(68).reason, Reason::INCONSISTENT);
}

TEST_F(Closures, AWrongSetIsQuarantinedOnceALargerOneContradictsIt) {
  for (const std::uint32_t query : {62, 64}) propose_wrongly(query);
  EXPECT_EQ(state(64), EdgeState::kAccepted);
  for (const std::uint32_t query : {66, 68}) propose(query);
  EXPECT_EQ(state(64), EdgeState::kAccepted) << "two against two";
  EXPECT_EQ(closure(68).reason, Reason::INCONSISTENT);
  propose(70);
  for (const std::uint32_t query : {62, 64}) {
    EXPECT_EQ(state(query), EdgeState::kQuarantined) << query;
    EXPECT_EQ(closure(query).reason, Reason::INCONSISTENT) << query;
  }
  for (const std::uint32_t query : {66, 68, 70}) EXPECT_EQ(state(query), EdgeState::kAccepted) << query;
  EXPECT_EQ(drive_.map().state().closures_quarantined, 2u);
  EXPECT_EQ(drive_.map().state().closures_accepted, 3u);
  expect_derived_facts_hold();
}

TEST_F(Closures, AQuarantinedSetComesBackWithEnoughNewEvidence) {
  for (const std::uint32_t query : {62, 64}) propose(query);
  for (const std::uint32_t query : {66, 68, 70}) propose_wrongly(query);
  EXPECT_EQ(state(62), EdgeState::kQuarantined);
  for (const std::uint32_t query : {72, 74}) propose(query);
  for (const std::uint32_t query : {62, 64, 72, 74}) EXPECT_EQ(state(query), EdgeState::kAccepted) << query;
  for (const std::uint32_t query : {66, 68, 70}) EXPECT_EQ(state(query), EdgeState::kQuarantined) << query;
  expect_derived_facts_hold();
}

}  // namespace
}  // namespace relmap
