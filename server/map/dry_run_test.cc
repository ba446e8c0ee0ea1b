#include "server/map/dry_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/map/testing/two_laps.h"
#include "storage/graph/forwarding_graph.h"

namespace relmap::map {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

class DryRuns : public TwoLaps {};

// Reads frames anew each time, as a map does whose frames are in no cache: only the caller holds them.
class UncachedGraph final : public storage::ForwardingGraph<storage::Graph> {
 public:
  explicit UncachedGraph(const storage::Graph& graph) : ForwardingGraph(graph) {}

  std::shared_ptr<const storage::FrameHot> hot(FrameId id) const override {
    const auto frame = ForwardingGraph::hot(id);
    return frame ? std::make_shared<const storage::FrameHot>(*frame) : nullptr;
  }
  std::shared_ptr<const storage::FrameWarm> warm(FrameId id) const override {
    const auto frame = ForwardingGraph::warm(id);
    return frame ? std::make_shared<const storage::FrameWarm>(*frame) : nullptr;
  }
};

// That the changes of single edits are those of the edit itself is tested with each edit (edge_edit_test.cc).
TEST_F(DryRuns, AProposalAndItsAcceptanceAreReportedAsOneChange) {
  const storage::MapHash before = storage::hash_map(drive_.map());
  DryRun run(drive_.map(), drive_.map().state());
  const auto proposal = true_closure(drive_.map(), world_, 62, kLap);
  const EdgeId id = run.propose(*proposal);
  EXPECT_EQ(run.edge(id).state, storage::EdgeState::kCandidate);
  ASSERT_TRUE(run.edit(edit_record(id, EdgeAction::kAccept)).ok());
  EXPECT_EQ(run.edge(id).reason, Reason::ACCEPTED_BY_OPERATOR);
  const std::vector<EdgeChange> changes = run.changes();
  ASSERT_THAT(changes, SizeIs(1));
  EXPECT_FALSE(changes[0].before);
  EXPECT_EQ(changes[0].after->state, storage::EdgeState::kAccepted);
  EXPECT_THAT(derived_differences(run.outcome()), IsEmpty());
  EXPECT_EQ(storage::hash_map(drive_.map()), before);

  propose(62);
  EXPECT_EQ(closure(62).id, id) << "the proposal gets the id that the dry run named";
}

TEST_F(DryRuns, AProposalThatConfirmsAnotherReportsBothChanges) {
  propose(62);
  const auto proposal = *true_closure(drive_.map(), world_, 64, kLap);
  DryRun run(drive_.map(), drive_.map().state());
  run.propose(proposal);
  const std::vector<EdgeChange> told = run.changes();
  ASSERT_THAT(told, SizeIs(2));
  EXPECT_FALSE(told[1].before) << "it was not there";
  EXPECT_EQ(told, drive_.apply(proposal).edges);
}

TEST_F(DryRuns, AnImpossibleEditIsRefusedAsTheEditIs) {
  propose(62);
  const storage::SetEdgeStateRecord restore = edit_record(closure(62).id, EdgeAction::kRestore);
  DryRun run(drive_.map(), drive_.map().state());
  const Status status = run.edit(restore);
  EXPECT_EQ(status.reason(), Reason::WRONG_STATE);
  EXPECT_EQ(status.to_string(), check_edge_edit(drive_.map(), restore).to_string());
  EXPECT_THAT(run.changes(), IsEmpty());
}

TEST_F(DryRuns, TheMarkOfARemovalIsThatOfTheMap) {
  propose(62);
  propose(64);
  DryRun run(drive_.map(), drive_.map().state());
  const EdgeId id = closure(62).id;
  EXPECT_EQ(run.removal(edit_record(id, EdgeAction::kRemove)), removal_mark(drive_.map(), id));
  EXPECT_EQ(run.removal(edit_record(id, EdgeAction::kRemoveAlone)), 0U) << "it takes out nothing else";
  EXPECT_EQ(run.removal(edit_record({{kDriveSession, 62}, 99}, EdgeAction::kRemove)), 0U) << "there is no such edge";
}

TEST_F(DryRuns, FramesAreHeldWhileTheyAreRead) {
  const UncachedGraph uncached(drive_.map());
  const auto proposal = *true_closure(drive_.map(), world_, 62, kLap);
  DryRun run(uncached, drive_.map().state()), cached(drive_.map(), drive_.map().state());
  const EdgeId id = cached.propose(proposal);
  EXPECT_EQ(run.propose(proposal), id);
  for (DryRun* one : {&run, &cached}) ASSERT_TRUE(one->edit(edit_record(id, EdgeAction::kAccept)).ok());
  EXPECT_EQ(run.changes(), cached.changes());
  EXPECT_THAT(derived_differences(run.outcome()), IsEmpty());
}

TEST_F(DryRuns, WhatProceedRefusesIsThrown) {
  propose(62);
  DryRun run(drive_.map(), drive_.map().state(), [](std::size_t) { return Status(Reason::BUDGET_EXCEEDED, "full"); });
  EXPECT_THROW((void)run.edit(edit_record(closure(62).id, EdgeAction::kAccept)), StatusError);
}

}  // namespace
}  // namespace relmap::map
