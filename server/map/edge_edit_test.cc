#include "server/map/edge_edit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "server/map/dry_run.h"
#include "server/map/testing/two_laps.h"
#include "server/place/testing/hand_made_graph.h"

namespace relmap::map {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class EdgeEdit : public TwoLaps {
 protected:
  std::vector<EdgeChange> edit(EdgeId id, EdgeAction action, const std::string& note = "") {
    const storage::SetEdgeStateRecord record = edit_record(id, action, note);
    const Status possible = check_edge_edit(drive_.map(), record);
    EXPECT_TRUE(possible.ok()) << possible.to_string();
    const std::vector<EdgeChange> told = told_of(record);
    std::vector<EdgeChange> done = drive_.apply(record).edges;
    EXPECT_EQ(told, done) << "a dry run tells what is done";
    expect_derived_facts_hold();
    return done;
  }
  // What a dry run tells.
  std::vector<EdgeChange> told_of(const storage::SetEdgeStateRecord& record) {
    const storage::MapHash before = storage::hash_map(drive_.map());
    DryRun run(drive_.map(), drive_.map().state());
    const Status made = run.edit(record);
    EXPECT_TRUE(made.ok()) << made.to_string();
    EXPECT_EQ(storage::hash_map(drive_.map()), before) << "and changes nothing";
    EXPECT_THAT(derived_differences(run.outcome()), IsEmpty());
    return run.changes();
  }
  Status refusal(EdgeId id, EdgeAction action) { return check_edge_edit(drive_.map(), edit_record(id, action)); }

  // Where each closure stands.
  std::map<EdgeId, EdgeStanding> standings() {
    std::map<EdgeId, EdgeStanding> all;
    for (std::uint32_t i = kLap; i < world_.options().frames; ++i)
      for (const storage::Edge& edge : drive_.map().hot({kDriveSession, i})->edges)
        if (edge.kind == storage::EdgeKind::kLoop) all.emplace(edge.id, EdgeStanding(edge));
    return all;
  }
};

TEST_F(EdgeEdit, AnOperatorAcceptsALoneClosureAndWithdrawsThat) {
  propose(62);
  const auto before = standings();
  const storage::MapHash map_before = storage::hash_map(drive_.map());
  const auto changes = edit(closure(62).id, EdgeAction::kAccept, "I was there");
  ASSERT_THAT(changes, SizeIs(1));
  EXPECT_EQ(changes[0].before->state, storage::EdgeState::kCandidate);
  EXPECT_TRUE(changes[0].after->in_graph);
  EXPECT_GT(changes[0].bound, 0u);
  EXPECT_EQ(state(62), storage::EdgeState::kAccepted);
  EXPECT_EQ(closure(62).reason, Reason::ACCEPTED_BY_OPERATOR);
  EXPECT_EQ(closure(62).history.back().note, "I was there");
  EXPECT_NE(storage::hash_map(drive_.map()).structure, map_before.structure);
  EXPECT_EQ(refusal(closure(62).id, EdgeAction::kAccept).reason(), Reason::WRONG_STATE);
  propose(64);
  EXPECT_EQ(state(64), storage::EdgeState::kAccepted) << "it agrees with one that is in force";

  edit(closure(64).id, EdgeAction::kRemove);
  EXPECT_EQ(state(62), storage::EdgeState::kAccepted) << "it goes when it is named itself";
  edit(closure(64).id, EdgeAction::kRestore);
  const auto withdrawn = edit(closure(62).id, EdgeAction::kWithdraw);
  EXPECT_THAT(withdrawn, SizeIs(2));
  EXPECT_EQ(standings().at(closure(62).id), before.at(closure(62).id));
  EXPECT_EQ(state(64), storage::EdgeState::kCandidate) << "nothing that is in force agrees with it";
  EXPECT_EQ(closure(64).reason, Reason::LONE);
  EXPECT_EQ(refusal(closure(62).id, EdgeAction::kWithdraw).reason(), Reason::WRONG_STATE);
}

TEST_F(EdgeEdit, AnOperatorsAcceptanceOutvotesASetAndIsNeverOutvoted) {
  for (const std::uint32_t query : {66, 68, 70}) propose_wrongly(query);
  propose(62);
  EXPECT_EQ(closure(62).reason, Reason::INCONSISTENT);
  const auto before = standings();
  EXPECT_THAT(edit(closure(62).id, EdgeAction::kAccept), SizeIs(4));
  for (const std::uint32_t query : {66, 68, 70}) {
    EXPECT_EQ(state(query), storage::EdgeState::kQuarantined) << query;
    EXPECT_EQ(closure(query).reason, Reason::INCONSISTENT) << query;
    EXPECT_EQ(closure(query).history.back().cause, closure(62).id) << query;
  }
  for (const std::uint32_t query : {72, 74}) {
    propose_wrongly(query);
    EXPECT_EQ(state(query), storage::EdgeState::kCandidate) << query << ": however many say so";
    EXPECT_EQ(closure(query).reason, Reason::INCONSISTENT) << query;
    EXPECT_EQ(closure(query).history.back().cause, closure(62).id) << query;
  }
  EXPECT_EQ(state(62), storage::EdgeState::kAccepted);

  edit(closure(62).id, EdgeAction::kWithdraw);
  for (const std::uint32_t query : {62, 66, 68, 70})
    EXPECT_EQ(standings().at(closure(query).id), before.at(closure(query).id)) << query;
  expect_derived_facts_hold();
}

TEST_F(EdgeEdit, AfterAWithdrawalClosuresThatOthersOpposeStayQuarantined) {
  for (const std::uint32_t query : {64, 66}) propose_wrongly(query);
  propose(62);
  edit(closure(62).id, EdgeAction::kAccept);
  EXPECT_EQ(state(66), storage::EdgeState::kQuarantined);
  for (const std::uint32_t query : {68, 70, 72}) propose(query);
  EXPECT_EQ(state(68), storage::EdgeState::kAccepted);
  edit(closure(62).id, EdgeAction::kWithdraw);
  EXPECT_EQ(state(62), storage::EdgeState::kCandidate);
  for (const std::uint32_t query : {68, 70, 72}) EXPECT_EQ(state(query), storage::EdgeState::kAccepted) << query;
  for (const std::uint32_t query : {64, 66}) EXPECT_EQ(state(query), storage::EdgeState::kQuarantined) << query;
}

TEST_F(EdgeEdit, ARemovalIsRefusedIfItWouldRemoveOtherClosuresThanShown) {
  for (const std::uint32_t query : {62, 64}) propose(query);
  ASSERT_EQ(state(64), storage::EdgeState::kAccepted);
  const EdgeId named = closure(62).id;
  storage::SetEdgeStateRecord shown = edit_record(named, EdgeAction::kRemove);
  shown.shown = removal_mark(drive_.map(), named);
  EXPECT_EQ(shown.shown >> 32, 2u);

  propose(66);  // one more that would go
  const storage::MapHash before = storage::hash_map(drive_.map());
  const Status refused = check_edge_edit(drive_.map(), shown);
  EXPECT_EQ(refused.reason(), Reason::WRONG_STATE);
  EXPECT_THAT(refused.message(), HasSubstr("2 closures would have gone then, 3 closures now"));
  EXPECT_THAT(drive_.apply(shown).edges, IsEmpty()) << "nor where the journal has it already";
  EXPECT_EQ(storage::hash_map(drive_.map()), before);

  edit(closure(64).id, EdgeAction::kRemoveAlone);  // as many as were shown, and not the same
  EXPECT_EQ(removal_mark(drive_.map(), named) >> 32, 2u);
  EXPECT_THAT(check_edge_edit(drive_.map(), shown).message(), HasSubstr("2 closures would have gone then, others now"));

  shown.shown = removal_mark(drive_.map(), named);
  EXPECT_THAT(drive_.apply(shown).edges, SizeIs(2));
  EXPECT_EQ(state(62), storage::EdgeState::kRemoved);
  EXPECT_EQ(state(66), storage::EdgeState::kRemoved);
}

TEST(EdgeRecord, OnlyARemovalOfAllThatAgreeIsBoundToWhatWasShown) {
  for (const EdgeAction action : {EdgeAction::kRemove, EdgeAction::kRemoveAlone, EdgeAction::kRestore,
                                  EdgeAction::kAccept, EdgeAction::kWithdraw}) {
    storage::SetEdgeStateRecord record = edit_record({{1, 62}, 1}, action);
    EXPECT_TRUE(check_edge_record(record).ok()) << static_cast<int>(action);
    EXPECT_EQ(removes_all(record), action == EdgeAction::kRemove) << static_cast<int>(action);
    record.shown = 1;
    EXPECT_EQ(check_edge_record(record).reason(), action == EdgeAction::kRemove ? Reason::OK : Reason::INVALID_ARGUMENT)
        << static_cast<int>(action);
  }
  storage::SetEdgeStateRecord decided = edit_record({{1, 62}, 1}, EdgeAction::kRemove);
  decided.decided = true;
  decided.shown = 1;
  EXPECT_TRUE(check_edge_record(decided).ok()) << "what is wrong with it is that it describes no action";
  EXPECT_EQ(action_of(decided).reason(), Reason::UNSUPPORTED);
}

TEST_F(EdgeEdit, AClosureRemovedAloneLeavesTheOthersInForceAndIsNotVotedBack) {
  for (const std::uint32_t query : {62, 64, 66, 68}) propose(query);
  const auto before = standings();
  const storage::MapHash map_before = storage::hash_map(drive_.map());
  const EdgeId named = closure(64).id;
  edit(named, EdgeAction::kRemoveAlone, "a reflection");
  EXPECT_EQ(closure(64).reason, Reason::REMOVED_ALONE);
  EXPECT_EQ(closure(64).history.back().note, "a reflection");
  for (const std::uint32_t query : {62, 66, 68}) {
    EXPECT_EQ(state(query), storage::EdgeState::kAccepted) << query;
    EXPECT_EQ(closure(query).reason, before.at(closure(query).id).reason) << query;
  }
  EXPECT_EQ(refusal(named, EdgeAction::kRemoveAlone).reason(), Reason::WRONG_STATE);
  edit(named, EdgeAction::kRestore);
  EXPECT_EQ(standings(), before);
  EXPECT_EQ(storage::hash_map(drive_.map()).structure, map_before.structure) << "undone exactly";

  edit(named, EdgeAction::kRemoveAlone);
  for (const std::uint32_t query : {70, 72, 74}) {
    propose(query);
    EXPECT_EQ(state(query), storage::EdgeState::kAccepted) << query << ": the operator said nothing of it";
    EXPECT_EQ(closure(query).reason, Reason::CONSISTENT) << query;
    EXPECT_EQ(closure(64).reason, Reason::REMOVED_ALONE) << query << " does not bring it back";
  }
  expect_derived_facts_hold();
}

TEST_F(EdgeEdit, AClosureRemovedAloneStaysRemovedWhenItsSetIsRestored) {
  for (const std::uint32_t query : {62, 64, 66}) propose(query);
  const auto before = standings();
  edit(closure(64).id, EdgeAction::kRemoveAlone);
  edit(closure(62).id, EdgeAction::kRemove);
  EXPECT_EQ(closure(64).reason, Reason::REMOVED_ALONE);
  EXPECT_EQ(closure(66).reason, Reason::REMOVED_WITH_SET);
  edit(closure(64).id, EdgeAction::kRestore);
  EXPECT_EQ(state(64), storage::EdgeState::kAccepted);
  EXPECT_EQ(state(66), storage::EdgeState::kRemoved) << "it went with another";
  edit(closure(64).id, EdgeAction::kRemoveAlone);
  edit(closure(62).id, EdgeAction::kRestore);
  EXPECT_EQ(state(66), storage::EdgeState::kAccepted);
  EXPECT_EQ(closure(64).reason, Reason::REMOVED_ALONE);
  edit(closure(64).id, EdgeAction::kRestore);
  EXPECT_EQ(standings(), before);
}

TEST_F(EdgeEdit, TheLastAgreeingClosureMayBeRemovedAlone) {
  for (const std::uint32_t query : {62, 64}) propose(query);
  edit(closure(64).id, EdgeAction::kRemoveAlone);
  EXPECT_EQ(state(62), storage::EdgeState::kAccepted);
  edit(closure(64).id, EdgeAction::kAccept);
  EXPECT_EQ(closure(64).reason, Reason::ACCEPTED_BY_OPERATOR);
  edit(closure(64).id, EdgeAction::kWithdraw);
  EXPECT_EQ(closure(64).reason, Reason::REMOVED_ALONE) << "what it was before the word";
  edit(closure(64).id, EdgeAction::kRestore);
  EXPECT_EQ(closure(64).reason, Reason::CONSISTENT);
}

TEST_F(EdgeEdit, AClosureInForceIsHeldThereByAnOperatorUntilWithdrawn) {
  for (const std::uint32_t query : {62, 64}) propose(query);
  const auto before = standings();
  const storage::MapHash map_before = storage::hash_map(drive_.map());
  const auto changes = edit(closure(62).id, EdgeAction::kAccept);
  ASSERT_THAT(changes, SizeIs(1));
  EXPECT_EQ(changes[0].before->in_graph, changes[0].after->in_graph);
  EXPECT_EQ(storage::hash_map(drive_.map()).estimates, map_before.estimates) << "nothing moves";
  for (const std::uint32_t query : {66, 68, 70}) propose_wrongly(query);
  EXPECT_EQ(state(62), storage::EdgeState::kAccepted);
  EXPECT_EQ(state(70), storage::EdgeState::kCandidate);
  edit(closure(62).id, EdgeAction::kWithdraw);
  EXPECT_EQ(standings().at(closure(62).id), before.at(closure(62).id));
  EXPECT_EQ(state(64), storage::EdgeState::kAccepted);
}

TEST_F(EdgeEdit, ARestoredClosureIsStillAcceptedByTheOperator) {
  propose(62);
  edit(closure(62).id, EdgeAction::kAccept);
  const storage::MapHash decided = storage::hash_map(drive_.map());
  edit(closure(62).id, EdgeAction::kRemove);
  EXPECT_EQ(state(62), storage::EdgeState::kRemoved);
  edit(closure(62).id, EdgeAction::kRestore);
  EXPECT_EQ(closure(62).reason, Reason::ACCEPTED_BY_OPERATOR);
  EXPECT_EQ(storage::hash_map(drive_.map()).structure, decided.structure);
  edit(closure(62).id, EdgeAction::kWithdraw);
  EXPECT_EQ(state(62), storage::EdgeState::kCandidate) << "what it was before it was accepted so";
  EXPECT_EQ(closure(62).reason, Reason::LONE);
}

TEST_F(EdgeEdit, ARemovedClosureMayBeAcceptedAndIsRemovedAgainWhenWithdrawn) {
  for (const std::uint32_t query : {62, 64}) propose(query);
  edit(closure(62).id, EdgeAction::kRemove);
  EXPECT_EQ(state(64), storage::EdgeState::kRemoved);
  edit(closure(64).id, EdgeAction::kAccept);
  EXPECT_EQ(closure(64).reason, Reason::ACCEPTED_BY_OPERATOR);
  EXPECT_EQ(state(62), storage::EdgeState::kRemoved);
  edit(closure(64).id, EdgeAction::kWithdraw);
  EXPECT_EQ(closure(64).reason, Reason::REMOVED_WITH_SET);
  edit(closure(62).id, EdgeAction::kRestore);
  for (const std::uint32_t query : {62, 64}) EXPECT_EQ(closure(query).reason, Reason::CONSISTENT) << query;
}

TEST_F(EdgeEdit, AcceptancesThatContradictEachOtherAreRefused) {
  propose(62);
  propose_wrongly(66);
  for (const std::uint32_t query : {72, 74}) propose_wrongly(query);
  edit(closure(72).id, EdgeAction::kRemove);
  edit(closure(62).id, EdgeAction::kAccept);
  const Status accept = refusal(closure(66).id, EdgeAction::kAccept);
  EXPECT_EQ(accept.reason(), Reason::WRONG_STATE);
  EXPECT_THAT(accept.message(), testing::HasSubstr(closure(62).id.to_string()));
  EXPECT_EQ(refusal(closure(72).id, EdgeAction::kRestore).reason(), Reason::WRONG_STATE);
  const storage::MapHash before = storage::hash_map(drive_.map());
  EXPECT_THAT(drive_.apply(edit_record(closure(66).id, EdgeAction::kAccept)).edges, IsEmpty());
  EXPECT_EQ(storage::hash_map(drive_.map()), before);
  edit(closure(62).id, EdgeAction::kRemove);
  edit(closure(72).id, EdgeAction::kRestore);
}

TEST_F(EdgeEdit, ClosuresWithoutMetresAreRefused) {
  for (const auto& [query, verification] :
       {std::pair{62u, storage::Verification::kEpipolar}, std::pair{64u, storage::Verification::kNone},
        std::pair{66u, storage::Verification::kImported}}) {
    auto proposal = wrong_closure(query);
    proposal.verification = verification;
    drive_.apply(proposal);
  }
  EXPECT_EQ(refusal(closure(62).id, EdgeAction::kAccept).reason(), Reason::UNSUPPORTED);
  EXPECT_THAT(refusal(closure(62).id, EdgeAction::kAccept).message(), testing::HasSubstr("epipolar"));
  EXPECT_THAT(refusal(closure(64).id, EdgeAction::kAccept).message(), testing::HasSubstr("never verified"));
  EXPECT_TRUE(refusal(closure(66).id, EdgeAction::kAccept).ok());
}

TEST_F(EdgeEdit, ClosuresThatBecomeEdgesInsteadAreAmongTheChanges) {
  for (const std::uint32_t query : {62, 64, 66}) propose(query);
  std::vector<EdgeId> edges, binding;
  for (const auto& [id, standing] : standings()) (standing.in_graph ? edges : binding).push_back(id);
  ASSERT_FALSE(edges.empty());
  ASSERT_FALSE(binding.empty()) << "two laps of one place need one edge";
  edit(binding.front(), EdgeAction::kAccept);
  const auto changes = edit(edges.front(), EdgeAction::kRemove);
  const auto comes = [](const EdgeChange& change) { return !change.before->in_graph && change.after->in_graph; };
  const auto goes = [](const EdgeChange& change) { return change.before->in_graph && !change.after->in_graph; };
  EXPECT_EQ(std::count_if(changes.begin(), changes.end(), comes), 1) << "the one that was held joins the laps now";
  EXPECT_EQ(std::count_if(changes.begin(), changes.end(), goes), 1);
}

TEST_F(EdgeEdit, OnlyLoopClosuresAreEdited) {
  propose(62);
  const EdgeId loop = closure(62).id, motion{{kDriveSession, 3}, 0};
  EXPECT_EQ(refusal(motion, EdgeAction::kAccept).reason(), Reason::ODOMETRY_EDGE);
  EXPECT_EQ(refusal({{kDriveSession, 3}, 7}, EdgeAction::kAccept).reason(), Reason::NO_SUCH_EDGE);
  storage::SetEdgeStateRecord odd = edit_record(loop, EdgeAction::kRemove);
  odd.decided = true;
  EXPECT_EQ(check_edge_edit(drive_.map(), odd).reason(), Reason::UNSUPPORTED);
  odd.decided = false;
  for (const EdgeAction action : {EdgeAction::kRestore, EdgeAction::kAccept, EdgeAction::kWithdraw}) {
    storage::SetEdgeStateRecord alone = edit_record(loop, action);
    alone.alone = true;
    EXPECT_EQ(check_edge_edit(drive_.map(), alone).reason(), Reason::UNSUPPORTED);
  }
  odd.state = storage::EdgeState::kQuarantined;
  EXPECT_EQ(check_edge_edit(drive_.map(), odd).reason(), Reason::UNSUPPORTED);
}

// Two acceptances may contradict each other however far apart their frames are: by one the robot was carried, and by
// the other it drove there.
TEST(EdgeEditOfARide, AnAcceptanceThatDeniesAnAcceptedRideIsRefused) {
  constexpr std::uint32_t kFrames = 300, kCarried = 100;
  place::HandMadeGraph graph;
  graph.add_session(1, {300, 160, 120, 0.1, 320, 240});
  const auto ahead = [](double metres) { return SE3(Matrix3::Identity(), {0, 0, metres}); };
  for (std::uint32_t i = 0; i < kFrames; ++i) {
    graph.add_frame({1, i});
    if (i > 0) graph.add_edge({1, i - 1}, {1, i}, 0, ahead(1));
  }
  const auto close = [&](std::uint32_t match, std::uint32_t query, double metres) -> storage::Edge& {
    graph.add_edge({1, match}, {1, query}, 1, ahead(metres), 1e-4 * Matrix6::Identity());
    storage::Edge& edge = graph.edit_hot({1, query}).edges.back();
    edge.verification = storage::Verification::kStereo;
    edge.state = storage::EdgeState::kCandidate;
    edge.prior_T_ab = edge.T_ab;
    edge.prior_covariance = edge.covariance;
    return edge;
  };
  storage::Edge& word = close(kCarried - 10, kCarried + 10, 60);
  const storage::Edge denies = close(10, kFrames - 10, kFrames - 20);
  const storage::SetEdgeStateRecord accept = edit_record(denies.id, EdgeAction::kAccept);
  EXPECT_TRUE(check_edge_edit(graph, accept).ok());
  word.state = storage::EdgeState::kAccepted;
  word.reason = Reason::ACCEPTED_BY_OPERATOR;
  word.carried = {1, kCarried - 1, kCarried};
  graph.edit_hot({1, kCarried}).edges.front().carried_by = {word.id};
  EXPECT_EQ(test_motion(graph, denies).verdict, MotionVerdict::kDenies);
  EXPECT_EQ(check_edge_edit(graph, accept).reason(), Reason::WRONG_STATE);
}

}  // namespace
}  // namespace relmap::map
