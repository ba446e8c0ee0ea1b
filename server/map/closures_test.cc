#include "server/map/closures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "server/map/testing/two_laps.h"
#include "storage/graph/binding.h"

namespace relmap::map {
namespace {

using Closures = TwoLaps;

TEST_F(Closures, TwoThatAgreeAreAccepted) {
  propose(62);
  EXPECT_EQ(closure(62).reason, Reason::LONE);
  propose(64);
  EXPECT_EQ(state(62), storage::EdgeState::kAccepted);
  EXPECT_EQ(state(64), storage::EdgeState::kAccepted);
  expect_derived_facts_hold();
}

// Of the landmarks begun on the second lap those that no claim in force has touched.
std::size_t in_force(const storage::Graph& graph) {
  std::size_t count = 0;
  for (std::uint32_t i = kLap; graph.hot({kDriveSession, i}); ++i)
    for (LandmarkId id{{kDriveSession, i}, 0}; id.slot < graph.hot(id.base)->landmarks.size(); ++id.slot)
      count += storage::resolve(graph, id) == id;
  return count;
}
// Half of what it binds is said not to be needed instead.
storage::ClosureProposalRecord with_less(storage::ClosureProposalRecord proposal) {
  for (std::size_t b = 0; b < proposal.bindings.size(); b += 2) proposal.bindings[b].landmark = {};
  return proposal;
}

TEST_F(Closures, UnneededLandmarksReturnWhenTheirClosureIsRemoved) {
  const std::size_t before = in_force(drive_.map());
  for (const std::uint32_t query : {62, 64}) drive_.apply(with_less(*true_closure(drive_.map(), world_, query, kLap)));
  EXPECT_EQ(state(64), storage::EdgeState::kAccepted);
  expect_derived_facts_hold();
  const std::size_t without = in_force(drive_.map());
  EXPECT_LT(without + 30, before);
  std::size_t meant_by_none = 0;
  for (const storage::Observation& z : drive_.map().warm({kDriveSession, 64})->observations)
    meant_by_none += !storage::resolve(drive_.map(), z.landmark).valid();
  EXPECT_GT(meant_by_none, 5u);

  drive_.apply(storage::SetEdgeStateRecord{closure(62).id, storage::EdgeState::kRemoved, ""});
  EXPECT_EQ(state(64), storage::EdgeState::kRemoved) << "with the set";
  EXPECT_EQ(in_force(drive_.map()), before);
  expect_derived_facts_hold();
  drive_.apply(storage::SetEdgeStateRecord{closure(62).id, storage::EdgeState::kAccepted, ""});
  EXPECT_EQ(in_force(drive_.map()), without);
  expect_derived_facts_hold();
}

TEST_F(Closures, ARestoredClosureReturnsToItsFormerState) {
  propose(62);
  const EdgeId lone = closure(62).id;
  drive_.apply(storage::SetEdgeStateRecord{lone, storage::EdgeState::kRemoved, "not sure"});
  EXPECT_EQ(state(62), storage::EdgeState::kRemoved);
  drive_.apply(storage::SetEdgeStateRecord{lone, storage::EdgeState::kAccepted, "sure"});
  EXPECT_EQ(state(62), storage::EdgeState::kCandidate);
  EXPECT_EQ(closure(62).reason, Reason::LONE);
  propose(64);
  EXPECT_EQ(state(62), storage::EdgeState::kAccepted) << "it has its say again";
  expect_derived_facts_hold();
}

TEST_F(Closures, ProposalsThatAgreeWithARemovedClosureStayCandidatesUntilItIsRestored) {
  for (const std::uint32_t query : {62, 64}) propose_wrongly(query);
  EXPECT_EQ(state(64), storage::EdgeState::kAccepted);
  drive_.apply(storage::SetEdgeStateRecord{closure(62).id, storage::EdgeState::kRemoved, "that is the other hall"});
  for (const std::uint32_t query : {66, 68}) {
    propose_wrongly(query);
    EXPECT_EQ(state(query), storage::EdgeState::kCandidate) << query;
    EXPECT_EQ(closure(query).reason, Reason::REMOVED_WITH_SET) << query;
    EXPECT_EQ(closure(query).history.back().cause, closure(62).id) << query;
  }
  for (const std::uint32_t query : {70, 72}) propose(query);
  EXPECT_EQ(state(72), storage::EdgeState::kAccepted) << "the right ones are not in the way";
  drive_.apply(storage::SetEdgeStateRecord{closure(62).id, storage::EdgeState::kAccepted, "no, it is this one"});
  EXPECT_EQ(state(62), storage::EdgeState::kAccepted);
  EXPECT_EQ(state(64), storage::EdgeState::kAccepted);
  expect_derived_facts_hold();
}

TEST_F(Closures, ABindingMayBeAlignedInThePictureOrMarkALandmarkAsUnneeded) {
  for (const std::uint32_t query : {62, 64}) propose(query);
  const FrameId frame{kDriveSession, 66};
  const auto seen = drive_.map().warm(frame)->observations;
  storage::BindingRecord record{frame, closure(64).id, {}};
  const LandmarkId old{{kDriveSession, 0}, 0};
  record.bindings.push_back({old, -1, 100, 50, 90, 1, true});
  for (std::int32_t track = 0; track < 4; ++track) record.bindings.push_back({{}, track});
  record.bindings.push_back({{}, -1});  // says nothing
  drive_.apply(record);
  const auto after = drive_.map().warm(frame)->observations;
  ASSERT_EQ(after.size(), seen.size() + 1);
  EXPECT_EQ(after.back().landmark, old);
  EXPECT_EQ(after.back().origin, closure(64).id);
  EXPECT_TRUE(after.back().aligned);
  std::size_t not_needed = 0;
  for (std::size_t track = 0; track < 4; ++track)
    not_needed += !storage::resolve(drive_.map(), after[track].landmark).valid();
  EXPECT_GE(not_needed, 2u) << "but for those that are claimed already";
  expect_derived_facts_hold();
  drive_.apply(record);
  EXPECT_EQ(drive_.map().warm(frame)->observations.size(), after.size()) << "the same again";
  expect_derived_facts_hold();
}

TEST(ClosuresOnTheWay, AnUnneededTrackIsContinued) {
  const sim::PointsWorld world(two_laps());
  PointsDrive drive;
  drive.apply(session_record(world));
  std::uint32_t i = 0;
  for (; i <= 64; ++i) drive.apply(keyframe_record(world, i));
  for (const std::uint32_t query : {62, 64}) {
    auto proposal = *true_closure(drive.map(), world, query, kLap);
    for (storage::ProposedBinding& binding : proposal.bindings) binding.landmark = {};
    drive.apply(proposal);
  }
  const auto before = drive.map().warm({kDriveSession, 64})->observations;
  drive.apply(keyframe_record(world, i));
  std::size_t gone_on = 0;
  for (const storage::Observation& z : drive.map().warm({kDriveSession, i})->observations) {
    const bool known = std::any_of(before.begin(), before.end(), [&](const storage::Observation& b) {
      return b.landmark == z.landmark && !storage::resolve(drive.map(), z.landmark).valid();
    });
    gone_on += known;
  }
  EXPECT_GT(gone_on, 5u);
  EXPECT_THAT(derived_differences(drive.map()), testing::IsEmpty());
}

TEST_F(Closures, AClosureThatContradictsAnAcceptedSetStaysACandidate) {
  for (const std::uint32_t query : {62, 64, 66}) propose(query);
  propose_wrongly(68);
  EXPECT_EQ(state(68), storage::EdgeState::kCandidate);
  EXPECT_EQ(closure(68).reason, Reason::INCONSISTENT);
}

TEST_F(Closures, AWrongSetIsQuarantinedOnceALargerOneContradictsIt) {
  for (const std::uint32_t query : {62, 64}) propose_wrongly(query);
  EXPECT_EQ(state(64), storage::EdgeState::kAccepted);
  for (const std::uint32_t query : {66, 68}) propose(query);
  EXPECT_EQ(state(64), storage::EdgeState::kAccepted) << "two against two";
  EXPECT_EQ(closure(68).reason, Reason::INCONSISTENT);
  propose(70);
  for (const std::uint32_t query : {62, 64}) {
    EXPECT_EQ(state(query), storage::EdgeState::kQuarantined) << query;
    EXPECT_EQ(closure(query).reason, Reason::INCONSISTENT) << query;
  }
  for (const std::uint32_t query : {66, 68, 70}) EXPECT_EQ(state(query), storage::EdgeState::kAccepted) << query;
  EXPECT_EQ(drive_.map().state().closures_quarantined, 2u);
  EXPECT_EQ(drive_.map().state().closures_accepted, 3u);
  expect_derived_facts_hold();
}

TEST_F(Closures, AQuarantinedSetIsAcceptedAgainWithEnoughNewEvidence) {
  for (const std::uint32_t query : {62, 64}) propose(query);
  for (const std::uint32_t query : {66, 68, 70}) propose_wrongly(query);
  EXPECT_EQ(state(62), storage::EdgeState::kQuarantined);
  for (const std::uint32_t query : {72, 74}) propose(query);
  for (const std::uint32_t query : {62, 64, 72, 74}) EXPECT_EQ(state(query), storage::EdgeState::kAccepted) << query;
  for (const std::uint32_t query : {66, 68, 70}) EXPECT_EQ(state(query), storage::EdgeState::kQuarantined) << query;
  expect_derived_facts_hold();
}

}  // namespace
}  // namespace relmap::map
