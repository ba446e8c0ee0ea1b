#include "server/map/carrying.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "server/map/carried_stretch.h"
#include "server/map/consistency.h"
#include "server/map/derived.h"
#include "server/map/edge_edit.h"
#include "server/map/testing/comparison.h"
#include "server/map/testing/counting_graph.h"
#include "server/map/testing/ridden_drive.h"

namespace relmap::map {
namespace {

using ::testing::IsEmpty;

std::vector<EdgeId> carriers(RiddenDrive& drive) {
  return storage::find_edge(drive.map(), RiddenDrive::ride())->carried_by;
}

// The first closures of the second lap, every one a frame further, until they come into force: how many it took.
std::uint32_t until_believed(RiddenDrive& drive,
                             const std::function<void(storage::ClosureProposalRecord&)>& change = {}) {
  for (std::uint32_t i = kCircuit + 1; i < kCircuit + kBeyond; ++i) {
    storage::ClosureProposalRecord proposal = drive.closure(i);
    if (change) change(proposal);
    if (drive.propose(proposal).state == storage::EdgeState::kAccepted) return i - kCircuit;
  }
  return 0;
}

TEST(Carrying, AgreeingClosuresOverSomeMetresMeanThatTheRobotWasCarriedWhereItStood) {
  RiddenDrive drive(kBeyond);
  const std::uint32_t first = kCircuit + 1;
  EXPECT_EQ(drive.propose(drive.closure(first)).reason, Reason::CONTRADICTS_MOTION)
      << "one place may look like another";
  EXPECT_EQ(drive.propose(drive.closure(first + 1)).reason, Reason::CONTRADICTS_MOTION) << "and two";
  EXPECT_THAT(carriers(drive), IsEmpty());
  std::uint32_t i = first + 2;
  while (i < kCircuit + kBeyond && drive.propose(drive.closure(i)).state != storage::EdgeState::kAccepted) ++i;
  ASSERT_LT(i, kCircuit + kBeyond);
  EXPECT_GE(0.2 * (i - first), 2) << "metres that they go on at least";
  for (std::uint32_t k = first; k <= i; ++k) {
    EXPECT_EQ(drive.closure_of(k).state, storage::EdgeState::kAccepted)
        << k << ": what was refused before comes into force";
    EXPECT_EQ(drive.closure_of(k).reason, Reason::CARRIED) << k;
  }
  EXPECT_EQ(carriers(drive).size(), i - first + 1);
  EXPECT_EQ(storage::find_edge(drive.map(), RiddenDrive::ride())->source, MotionSource::kVision)
      << "what the robot said stays";
  EXPECT_THAT(derived_differences(drive.map()), IsEmpty());

  // The closures' measurement replaces the odometry.
  const auto ride = measured_stretch(drive.map(), *storage::find_edge(drive.map(), RiddenDrive::ride()), {});
  ASSERT_TRUE(ride);
  EXPECT_EQ(ride->b.index, ride->a.index + 1);
  EXPECT_NEAR(ride->T_ab.t.norm(), 0.2 * (RiddenDrive::kRidden + 1), 0.3);
}

TEST(Carrying, WithoutAStopTheOdometryPrevails) {
  for (const double stood_s : {0.0, 1.0}) {
    RiddenDrive drive(kBeyond, stood_s);
    EXPECT_EQ(until_believed(drive), 0u) << stood_s << " s";
    EXPECT_THAT(carriers(drive), IsEmpty());
    EXPECT_EQ(drive.map().state().closures_accepted, 0u);
  }
}

TEST(Carrying, PlacesThatAreNotUniqueOrLookDifferentAreNoEvidence) {
  RiddenDrive alike(kBeyond), different(kBeyond), unique(kBeyond);
  EXPECT_EQ(until_believed(alike,
                           [](storage::ClosureProposalRecord& p) {
                             p.uniqueness.known = true;
                             p.uniqueness.runner_up_inliers = static_cast<std::uint16_t>(0.9 * p.inliers);
                           }),
            0u);
  EXPECT_EQ(until_believed(different,
                           [](storage::ClosureProposalRecord& p) {
                             p.uniqueness.known = true;
                             p.uniqueness.differs = 0.6f;
                           }),
            0u);
  EXPECT_GT(until_believed(unique,
                           [](storage::ClosureProposalRecord& p) {
                             p.uniqueness.known = true;
                             p.uniqueness.differs = 0.1f;
                           }),
            0u);
}

TEST(Carrying, LaterClosuresAreTestedAgainstTheMeasuredRide) {
  RiddenDrive drive(kBeyond);
  const std::uint32_t believed = kCircuit + until_believed(drive);
  ASSERT_GT(believed, kCircuit);
  const storage::Edge right = drive.propose(drive.closure(believed + 1));
  EXPECT_EQ(right.state, storage::EdgeState::kAccepted);
  EXPECT_EQ(right.reason, Reason::CARRIED) << "it vouches for the ride, too";
  EXPECT_EQ(right.carried, drive.closure_of(believed).carried);
  const storage::Edge beside = drive.propose(drive.closure(believed + 2, 1));
  EXPECT_EQ(beside.reason, Reason::CONTRADICTS_MOTION) << "one ride does not open the door to whatever comes";
  const storage::Edge driven = drive.propose(drive.as_driven(believed + 3));
  EXPECT_EQ(test_motion(drive.map(), driven).verdict, MotionVerdict::kDenies);
  EXPECT_EQ(driven.state, storage::EdgeState::kCandidate);
  EXPECT_EQ(driven.reason, Reason::INCONSISTENT);
  EXPECT_THAT(derived_differences(drive.map()), IsEmpty());
}

void decide(RiddenDrive& drive, EdgeId id, EdgeAction action = EdgeAction::kAccept) {
  const storage::SetEdgeStateRecord record = edit_record(id, action);
  const Status possible = check_edge_edit(drive.map(), record);
  EXPECT_TRUE(possible.ok()) << possible.to_string();
  drive.drive().apply(record);
  EXPECT_THAT(derived_differences(drive.map()), IsEmpty());
}

TEST(Carrying, RemovingAndRestoringAClosureRemovesAndRestoresTheRide) {
  RiddenDrive drive(kBeyond), without(kBeyond);
  const std::uint32_t believed = kCircuit + until_believed(drive);
  ASSERT_GT(believed, kCircuit);
  const auto before = carriers(drive);
  const EdgeId any = drive.closure_of(believed).id;
  drive.drive().apply(storage::SetEdgeStateRecord{any, storage::EdgeState::kRemoved, "test"});
  EXPECT_THAT(carriers(drive), IsEmpty());
  EXPECT_EQ(drive.map().state().closures_accepted, 0u);
  EXPECT_THAT(derived_differences(drive.map()), IsEmpty());
  EXPECT_THAT(structural_differences(drive.map(), without.map(), kDriveSession), IsEmpty());
  EXPECT_EQ(drive.propose(drive.closure(believed + 1)).state, storage::EdgeState::kCandidate)
      << "what was taken out stays out";

  drive.drive().apply(storage::SetEdgeStateRecord{any, storage::EdgeState::kAccepted, "no, it was"});
  EXPECT_EQ(carriers(drive), before);
  EXPECT_THAT(derived_differences(drive.map()), IsEmpty());

  // Removed alone, it takes only itself out of the carriers.
  auto without_it = before;
  std::erase(without_it, any);
  decide(drive, any, EdgeAction::kRemoveAlone);
  EXPECT_EQ(carriers(drive), without_it);
  decide(drive, any, EdgeAction::kRestore);
  EXPECT_EQ(carriers(drive), before);
}

TEST(Carrying, MoreClosuresThatAgreeWithTheOdometryOverturnARide) {
  RiddenDrive drive(kBeyond);
  const std::uint32_t believed = kCircuit + until_believed(drive);
  ASSERT_GT(believed, kCircuit);
  ASSERT_LE(believed + 3, kCircuit + kBeyond);
  // Most of the frames behind are seen where the odometry has them.
  std::uint32_t needed = 0;
  for (std::uint32_t i = kCircuit + 1; i < kCircuit + kBeyond && !carriers(drive).empty(); ++i, ++needed) {
    storage::ClosureProposalRecord driven = drive.as_driven(i);
    driven.match.index += 1;  // frames are recognised once each with each place
    const auto match = drive.map().hot(driven.match), query = drive.map().hot(driven.query);
    driven.T_match_query = match->T_odom_frame.inverse() * query->T_odom_frame;
    drive.propose(driven);
  }
  EXPECT_THAT(carriers(drive), IsEmpty()) << needed;
  EXPECT_GT(needed, 3u) << "not by a few";
  for (std::uint32_t k = kCircuit + 1; k <= believed; ++k)
    for (const storage::Edge& edge : drive.map().hot(RiddenDrive::frame(k))->edges)
      if (edge.carried.session != 0) {
        EXPECT_EQ(edge.state, storage::EdgeState::kQuarantined) << k;
      }
  EXPECT_THAT(derived_differences(drive.map()), IsEmpty());
}

TEST(Carrying, ClosuresAcrossTheRideThatAgreeWithTheOdometrySpeakAgainstIt) {
  RiddenDrive drive(kBeyond);
  // Recognised from behind the ride in the same places as the odometry has it: it cannot have been carried.
  for (const std::uint32_t i : {kCircuit + 1, kCircuit + 3}) drive.propose(drive.as_driven(i));
  ASSERT_EQ(drive.closure_of(kCircuit + 3).state, storage::EdgeState::kAccepted);
  for (std::uint32_t i = kCircuit + 4; i < kCircuit + kBeyond; ++i)
    EXPECT_EQ(drive.propose(drive.closure(i)).state, storage::EdgeState::kCandidate) << i;
  EXPECT_THAT(carriers(drive), IsEmpty());
}

// "Frame i of the world is where the odometry has it from frame `match`."
storage::ClosureProposalRecord driven_from(RiddenDrive& drive, std::uint32_t i, std::uint32_t match) {
  storage::ClosureProposalRecord proposal = drive.as_driven(i);
  proposal.match = RiddenDrive::frame(match);
  proposal.T_match_query =
      drive.map().hot(proposal.match)->T_odom_frame.inverse() * drive.map().hot(proposal.query)->T_odom_frame;
  return proposal;
}

// Closures of the ride that are candidates, for so many frames from that of the world on.
std::vector<EdgeId> candidates(RiddenDrive& drive, std::uint32_t from, std::uint32_t count) {
  std::vector<EdgeId> ids;
  for (std::uint32_t i = from; i < from + count; ++i) {
    const storage::Edge edge = drive.propose(drive.closure(i));
    EXPECT_EQ(edge.reason, Reason::CONTRADICTS_MOTION) << i;
    ids.push_back(edge.id);
  }
  return ids;
}

TEST(Carrying, ClosuresWhoseMotionIsUntestedDoNotSpeakAgainstARide) {
  RiddenDrive drive(kBeyond);
  constexpr std::uint32_t kBlindStep = 6;
  drive.map().edit_hot(RiddenDrive::frame(kBlindStep)).edges.front().source = MotionSource::kUnsensed;
  // They lead across the ride and over motion that nothing sensed, and came into force because they agree.
  for (const std::uint32_t i : {1u, 3u}) drive.propose(drive.as_driven(kCircuit + i));
  for (const std::uint32_t i : {16u, 18u}) drive.propose(driven_from(drive, kCircuit + i, i - 14));
  for (const std::uint32_t i : {1u, 3u, 16u, 18u}) {
    const storage::Edge closure = drive.closure_of(kCircuit + i);
    ASSERT_EQ(closure.state, storage::EdgeState::kAccepted) << i;
    EXPECT_EQ(test_motion(drive.map(), closure).verdict, MotionVerdict::kUntested);
  }
  std::uint32_t i = kCircuit + kBlindStep + 2;
  while (i < kCircuit + kBeyond && drive.propose(drive.closure(i)).state != storage::EdgeState::kAccepted) ++i;
  EXPECT_LT(i, kCircuit + kBeyond);
  EXPECT_FALSE(carriers(drive).empty());
}

TEST(Carrying, ClosuresAcceptedByAnOperatorSpeakAgainstARideToo) {
  RiddenDrive drive(kBeyond);
  const storage::Edge driven = drive.propose(drive.as_driven(kCircuit + 20));
  ASSERT_EQ(driven.reason, Reason::LONE);
  decide(drive, driven.id);
  const auto ride = candidates(drive, kCircuit + 1, 15);
  const CarryingEvidence evidence = weigh_carrying(drive.map(), ride);
  EXPECT_GT(evidence.metres, 2);
  EXPECT_EQ(evidence.stretch.session, 0u) << "it covers the ride, and agrees with the odometry";
  EXPECT_FALSE(evidence.speaks_for_carrying());
}

// Testing a closure against the odometry walks the whole path between its ends, so only few are tested.
TEST(Carrying, OfManyClosuresOverTheSameStepsFewAreTested) {
  RiddenDrive drive(kBeyond);
  std::size_t reads[2] = {};
  for (const std::uint32_t many : {2u, 20u}) {
    for (std::uint32_t i = 1; i <= many; ++i) drive.propose(drive.as_driven(kCircuit + i));
    ASSERT_EQ(drive.closure_of(kCircuit + many).state, storage::EdgeState::kAccepted);
    const auto ride = candidates(drive, kCircuit + many + 1, 4);
    const CountingGraph counting(drive.map());
    EXPECT_EQ(weigh_carrying(counting, ride).stretch.session, 0u);
    reads[many > 2] = counting.hot_reads();
  }
  EXPECT_LT(reads[1], 1.5 * static_cast<double>(reads[0]));
}

TEST(Carrying, AnOperatorsAcceptanceImpliesARideWithoutAStop) {
  RiddenDrive drive(kBeyond, 0), without(kBeyond, 0);
  const std::uint32_t named = kCircuit + 10;
  const storage::Edge closure = drive.propose(drive.closure(named));
  without.propose(without.closure(named));
  ASSERT_EQ(closure.reason, Reason::CONTRADICTS_MOTION);
  const storage::MapHash before = storage::hash_map(drive.map());
  decide(drive, closure.id);
  const std::uint32_t at = RiddenDrive::frame(named).index;
  const storage::FrameRange step{kDriveSession, at - 1, at};
  EXPECT_EQ(drive.closure_of(named).carried, step) << "the newest: what is known is recognised soon";
  const EdgeId carried{RiddenDrive::frame(named), 0};
  EXPECT_EQ(storage::find_edge(drive.map(), carried)->carried_by, std::vector<EdgeId>{closure.id});
  EXPECT_NE(storage::hash_map(drive.map()), before);

  const storage::Edge later = drive.propose(drive.closure(named + 3));
  EXPECT_EQ(later.state, storage::EdgeState::kAccepted) << "it agrees with what was measured";
  EXPECT_EQ(later.reason, Reason::CARRIED);
  EXPECT_EQ(later.carried, step);
  EXPECT_EQ(drive.propose(drive.as_driven(named + 5)).reason, Reason::INCONSISTENT);
  EXPECT_THAT(derived_differences(drive.map()), IsEmpty());

  decide(drive, closure.id, EdgeAction::kRemove);
  decide(drive, closure.id, EdgeAction::kRestore);
  EXPECT_EQ(drive.closure_of(named).carried, step);
  decide(drive, closure.id, EdgeAction::kWithdraw);
  EXPECT_EQ(drive.closure_of(named).state, closure.state);
  EXPECT_EQ(drive.closure_of(named).reason, closure.reason);
  EXPECT_EQ(drive.closure_of(named).carried, storage::FrameRange{});
  EXPECT_EQ(drive.closure_of(named + 3).state, storage::EdgeState::kCandidate) << "it stood on that word alone";
  EXPECT_THAT(storage::find_edge(drive.map(), carried)->carried_by, IsEmpty());
  EXPECT_THAT(structural_differences(drive.map(), without.map(), kDriveSession), IsEmpty());
}

TEST(Carrying, ClosuresThatDependOnAnAcceptanceGoWithIt) {
  RiddenDrive drive(kBeyond, 0), without(kBeyond, 0);
  const std::uint32_t named = kCircuit + 10;
  const EdgeId word = drive.propose(drive.closure(named)).id;
  without.propose(without.closure(named));
  decide(drive, word);
  const EdgeId carried{RiddenDrive::frame(named), 0};
  for (const std::uint32_t later : {named + 3, named + 6, named + 9}) {
    ASSERT_EQ(drive.propose(drive.closure(later)).reason, Reason::CARRIED);
    without.propose(without.closure(later));
  }
  decide(drive, word, EdgeAction::kWithdraw);
  EXPECT_THAT(storage::find_edge(drive.map(), carried)->carried_by, IsEmpty());
  EXPECT_EQ(drive.map().state().closures_accepted, 0u);
  for (const std::uint32_t later : {named + 3, named + 6, named + 9}) {
    EXPECT_EQ(drive.closure_of(later).reason, Reason::CONTRADICTS_MOTION);
    EXPECT_EQ(drive.closure_of(later).carried, storage::FrameRange{});
  }
  EXPECT_THAT(derived_differences(drive.map()), IsEmpty());
  EXPECT_THAT(structural_differences(drive.map(), without.map(), kDriveSession), IsEmpty());
}

TEST(Carrying, ClosuresThatProveARideByThemselvesOutliveTheAcceptance) {
  RiddenDrive drive(kBeyond);
  const EdgeId word = drive.propose(drive.closure(kCircuit + 1)).id;
  decide(drive, word);
  for (std::uint32_t i = kCircuit + 2; i < kCircuit + kBeyond; ++i)
    ASSERT_EQ(drive.propose(drive.closure(i)).reason, Reason::CARRIED) << i;
  decide(drive, word, EdgeAction::kWithdraw);
  EXPECT_EQ(drive.closure_of(kCircuit + 20).state, storage::EdgeState::kAccepted)
      << "the robot stood there, and was seen to be away";
  EXPECT_THAT(derived_differences(drive.map()), IsEmpty());
}

TEST(Carrying, AWithdrawnAcceptanceLeavesNoRideBehind) {
  RiddenDrive drive(kBeyond, 0);
  const storage::Edge closure = drive.propose(drive.closure(kCircuit + 10));
  decide(drive, closure.id);
  decide(drive, closure.id, EdgeAction::kWithdraw);
  EXPECT_EQ(drive.closure_of(kCircuit + 10).carried, closure.carried);
  const std::uint64_t before = storage::hash_map(drive.map()).structure;
  decide(drive, closure.id);
  EXPECT_NE(drive.closure_of(kCircuit + 10).carried, closure.carried) << "and can be given again";
  decide(drive, closure.id, EdgeAction::kWithdraw);
  EXPECT_EQ(storage::hash_map(drive.map()).structure, before);
}

// The ride lies before the frames whose closures agree with the odometry, and these closures stay in force.
TEST(Carrying, AnAcceptedRideLiesWhereNoClosureAgreesWithTheOdometry) {
  RiddenDrive drive(kBeyond, 0);
  constexpr std::uint32_t kSeen = RiddenDrive::kAlights + 9;
  for (const std::uint32_t i : {1u, 4u, 12u}) drive.propose(driven_from(drive, kCircuit + i, kSeen + i));
  for (const std::uint32_t i : {4u, 12u})
    ASSERT_EQ(drive.closure_of(kCircuit + i).state, storage::EdgeState::kAccepted) << i;
  const storage::Edge closure = drive.propose(drive.closure(kCircuit + 10));
  ASSERT_EQ(closure.reason, Reason::CONTRADICTS_MOTION);
  decide(drive, closure.id);
  const std::uint32_t seen = RiddenDrive::frame(kSeen + 1).index;
  EXPECT_EQ(drive.closure_of(kCircuit + 10).carried, (storage::FrameRange{kDriveSession, seen - 1, seen}));
  for (const std::uint32_t i : {1u, 4u, 12u})
    EXPECT_EQ(drive.closure_of(kCircuit + i).state, storage::EdgeState::kAccepted) << i << ": it lies behind the ride";
  EXPECT_EQ(drive.propose(drive.closure(kCircuit + 13)).reason, Reason::CARRIED);
}

TEST(Carrying, AnAcceptedRideIsPlacedAtTheRobotsStop) {
  RiddenDrive drive(kBeyond, 1);  // too short to say anything by itself
  const storage::Edge closure = drive.propose(drive.closure(kCircuit + 10));
  decide(drive, closure.id);
  const std::uint32_t alights = RiddenDrive::frame(RiddenDrive::kAlights).index;
  EXPECT_EQ(drive.closure_of(kCircuit + 10).carried, (storage::FrameRange{kDriveSession, alights - 1, alights}));
}

TEST(Carrying, CandidatesOfTheSameRideNarrowDownWhereItWas) {
  RiddenDrive drive(kBeyond, 0);
  candidates(drive, kCircuit + 5, 2);
  const storage::Edge closure = drive.propose(drive.closure(kCircuit + 10));
  decide(drive, closure.id);
  const std::uint32_t first = RiddenDrive::frame(kCircuit + 5).index;
  EXPECT_EQ(drive.closure_of(kCircuit + 10).carried, (storage::FrameRange{kDriveSession, first - 1, first}));
  EXPECT_EQ(drive.closure_of(kCircuit + 6).state, storage::EdgeState::kCandidate) << "the word is about one closure";
}

}  // namespace
}  // namespace relmap::map
