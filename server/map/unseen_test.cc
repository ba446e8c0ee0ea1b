#include "server/map/unseen.h"

#include <gtest/gtest.h>

#include "server/map/testing/two_laps.h"
#include "server/place/testing/synthetic_street.h"

namespace relmap::map {
namespace {

using place::kStreetCamera;

// Session 1 has driven a street. Session 2 recognises its frame 5 there, and drives on.
class GoesOn : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kFrames = 40, kRecognised = 5, kNow = 15;

  GoesOn() {
    for (std::uint32_t i = 0; i < kFrames; ++i) {
      street_.graph.add_frame({2, i});
      if (i == 0) continue;
      street_.graph.add_edge({2, i - 1}, {2, i}, 0, step_);
      street_.graph.edit_hot({2, i}).edges.front().driven_s = 1;
    }
    close(kRecognised, kRecognised);
  }
  void close(std::uint32_t match, std::uint32_t query) {
    street_.graph.add_edge({1, match}, {2, query}, 1);
    street_.graph.edit_hot({2, query}).edges.back().verification = storage::Verification::kStereo;
  }
  std::vector<AppearanceFeature> picture_of(place::SyntheticStreet& street, std::uint32_t frame) const {
    std::vector<std::size_t> points;
    return street.picture(street.pose(frame), true, points);
  }
  std::optional<storage::UnseenRecord> find(const std::vector<AppearanceFeature>& seen, std::uint32_t frame = kNow,
                                            FrameId recognised = {}) const {
    return find_unseen(street_.graph, {seen, kStreetCamera}, {2, frame}, recognised, 1);
  }

  const SE3 step_{Matrix3::Identity(), Vector3(0, 0, 0.3)};
  place::SyntheticStreet street_{3, kFrames, 0.3, 2000};
  place::SyntheticStreet elsewhere_{4, kFrames, 0.3, 2000};
};

TEST_F(GoesOn, WhereTheMapShowsSomethingElseNothingOfItIsSeen) {
  const auto unseen = find(picture_of(elsewhere_, kNow));
  ASSERT_TRUE(unseen);
  EXPECT_EQ(unseen->frame, (FrameId{2, kNow}));
  EXPECT_EQ(unseen->closure, (ClosureId{{2, kRecognised}, 1}));
}

TEST_F(GoesOn, APlaceThatIsSeenAgainSpeaksForTheClosure) { EXPECT_FALSE(find(picture_of(street_, kNow))); }

// Of a place that has changed in most parts, something is left.
TEST_F(GoesOn, APlaceThatHasChangedInPartsIsSeen) {
  std::vector<AppearanceFeature> seen = picture_of(street_, kNow);
  const std::vector<AppearanceFeature> other = picture_of(elsewhere_, kNow);
  for (std::size_t f = 0; f < std::min(seen.size(), other.size()); ++f)
    if (f % 10 != 0) seen[f].descriptor = other[f].descriptor;
  EXPECT_FALSE(find(seen));
}

// The map may be wrong by more than its covariances say; geometry still finds what is there.
TEST_F(GoesOn, WhatIsSeenFromElsewhereThanExpectedIsSeen) {
  street_.graph.edit_hot({2, kNow}).edges.front().T_ab.t.x() += 1;
  EXPECT_FALSE(find(picture_of(street_, kNow)));
}

TEST_F(GoesOn, APictureThatShowsNothingTellsNothing) {
  std::vector<AppearanceFeature> few = picture_of(elsewhere_, kNow);
  few.resize(15);
  EXPECT_FALSE(find(few));
}

TEST_F(GoesOn, BeyondTheEndOfTheMapNothingIsExpected) {
  street_.graph.edit_hot({2, kNow}).edges.front().T_ab.t.z() += 100;
  EXPECT_FALSE(find(picture_of(elsewhere_, kNow)));
}

TEST_F(GoesOn, WhoTurnsRoundExpectsNothing) {
  street_.graph.edit_hot({2, kNow}).edges.front().T_ab.R = so3_exp(Vector3(0, 2, 0));
  EXPECT_FALSE(find(picture_of(elsewhere_, kNow)));
}

TEST_F(GoesOn, BehindAStopTheRobotMayHaveBeenCarriedAway) {
  storage::Edge& step = street_.graph.edit_hot({2, kNow - 3}).edges.front();
  step.driven_s = 0;
  step.standing_s = 5;
  EXPECT_FALSE(find(picture_of(elsewhere_, kNow)));
}

// It is then not known what lies beyond.
TEST_F(GoesOn, WhoWasThereBeforeMayHaveBeenCarriedAwayToo) {
  storage::Edge& step = street_.graph.edit_hot({1, kRecognised + 3}).edges.front();
  step.driven_s = 0;
  step.standing_s = 5;
  EXPECT_FALSE(find(picture_of(elsewhere_, kNow)));
  EXPECT_TRUE(find(picture_of(elsewhere_, kRecognised + 2), kRecognised + 2)) << "before the stop";
}

TEST_F(GoesOn, WhatIsRecognisedElsewhereSpeaksAgainstTheClosure) {
  EXPECT_TRUE(find(picture_of(elsewhere_, kNow), kNow, {7, 0}));
  EXPECT_FALSE(find(picture_of(elsewhere_, kNow), kNow, {1, kNow})) << "it is of that very stretch";
}

TEST_F(GoesOn, AClosureOutOfForceLeadsNowhere) {
  street_.graph.edit_hot({2, kRecognised}).edges.back().state = storage::EdgeState::kQuarantined;
  EXPECT_FALSE(find(picture_of(elsewhere_, kNow)));
}

class Unseen : public TwoLaps {
 protected:
  static constexpr std::int64_t kTime = 1'700'000'000'000'000;

  void not_seen(std::uint32_t first, std::uint32_t count, std::uint32_t query) {
    for (std::uint32_t i = first; i < first + count; ++i)
      drive_.apply(storage::UnseenRecord{{kDriveSession, i}, closure(query).id, {}, {kTime + i, {}}});
  }
};

TEST_F(Unseen, ClosuresGoOutOfForceWhenMoreFramesSeeNothingThanClosuresAgree) {
  // Next to each other, so that the three agree: with frames between them the robot's own steps speak against one.
  for (const std::uint32_t query : {62, 63, 64}) propose_wrongly(query);
  not_seen(70, 7, 64);
  for (const std::uint32_t query : {62, 63, 64}) EXPECT_EQ(state(query), storage::EdgeState::kAccepted) << query;
  not_seen(70, 7, 64);
  EXPECT_EQ(state(64), storage::EdgeState::kAccepted) << "the same frames again say nothing new";
  not_seen(77, 1, 64);
  for (const std::uint32_t query : {62, 63, 64}) {
    EXPECT_EQ(state(query), storage::EdgeState::kQuarantined) << query;
    EXPECT_EQ(closure(query).reason, Reason::NOT_SEEN_BEYOND) << query;
    EXPECT_EQ(closure(query).history.back().time_us, kTime + 77) << "when the record was submitted that decided";
  }
  EXPECT_EQ(closure(64).unseen.size(), 8u);
  expect_derived_facts_hold();
  propose_wrongly(80);
  EXPECT_EQ(closure(80).reason, Reason::LONE) << "they are no witnesses any more";
}

TEST_F(Unseen, AsManyAgreeingClosuresHold) {
  for (std::uint32_t query = 61; query < 71; ++query) propose(query);
  not_seen(75, 10, 70);
  EXPECT_EQ(state(70), storage::EdgeState::kAccepted);
  not_seen(85, 1, 70);
  EXPECT_EQ(state(70), storage::EdgeState::kQuarantined);
  EXPECT_EQ(state(61), storage::EdgeState::kQuarantined);
  expect_derived_facts_hold();
}

// A lookup may be made again after a restart, and then see newer closures.
TEST_F(Unseen, AFrameIsCountedOnceWhicheverClosureItNames) {
  for (const std::uint32_t query : {62, 64}) propose_wrongly(query);
  not_seen(70, 4, 62);
  not_seen(70, 4, 64);
  EXPECT_EQ(state(64), storage::EdgeState::kAccepted);
}

TEST_F(Unseen, AProposalMayTellOfAnotherClosureWhosePlaceIsNotSeen) {
  for (const std::uint32_t query : {62, 64}) propose_wrongly(query);
  not_seen(70, 7, 64);
  auto proposal = *true_closure(drive_.map(), world_, 80, kLap);
  proposal.unseen = closure(64).id;
  drive_.apply(proposal);
  EXPECT_EQ(closure(64).reason, Reason::NOT_SEEN_BEYOND);
  EXPECT_EQ(closure(80).a, proposal.match);
  expect_derived_facts_hold();
}

TEST_F(Unseen, WhatAnOperatorPutIntoForceHolds) {
  for (const std::uint32_t query : {62, 64}) propose(query);
  drive_.apply(storage::SetEdgeStateRecord{closure(62).id, storage::EdgeState::kAccepted, "I was there", true});
  not_seen(70, 12, 64);
  EXPECT_EQ(state(64), storage::EdgeState::kAccepted);
}

TEST_F(Unseen, ARecordThatNamesNothingChangesNothing) {
  for (const std::uint32_t query : {62, 64}) propose(query);
  drive_.apply(storage::UnseenRecord{{kDriveSession, 70}, {{kDriveSession, 63}, 1}});
  drive_.apply(storage::UnseenRecord{{kDriveSession, 60}, closure(64).id});
  drive_.apply(storage::UnseenRecord{{kDriveSession, 5000}, closure(64).id});
  drive_.apply(storage::UnseenRecord{{9, 70}, closure(64).id});
  EXPECT_TRUE(closure(64).unseen.empty());
}

}  // namespace
}  // namespace relmap::map
