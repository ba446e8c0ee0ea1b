#include "server/rpc/messages.h"

#include <gtest/gtest.h>

#include <array>
#include <set>

namespace relmap::rpc {
namespace {

// All values that can be stored.
constexpr std::array kStored = {storage::Verification::kNone,     storage::Verification::kStereo,
                                storage::Verification::kPnP,      storage::Verification::kEpipolar,
                                storage::Verification::kImported, storage::Verification::kCompounded};

TEST(VerificationOnTheWire, HasAllStoredValues) {
  constexpr std::array kExpected = {v1::VERIFICATION_NONE,     v1::VERIFICATION_STEREO,   v1::VERIFICATION_PNP,
                                    v1::VERIFICATION_EPIPOLAR, v1::VERIFICATION_IMPORTED, v1::VERIFICATION_COMPOUNDED};
  for (std::size_t i = 0; i < kStored.size(); ++i) EXPECT_EQ(to_wire(kStored[i]), kExpected[i]) << i;
}

TEST(VerificationOnTheWire, HasOnlyStoredValuesAndHomography) {
  std::set<int> wire{v1::VERIFICATION_HOMOGRAPHY};
  for (const storage::Verification verification : kStored)
    EXPECT_TRUE(wire.insert(to_wire(verification)).second) << v1::Verification_Name(to_wire(verification));
  for (int value = v1::Verification_MIN; value <= v1::Verification_MAX; ++value)
    EXPECT_EQ(wire.contains(value), v1::Verification_IsValid(value)) << value;
}

TEST(CountsOfReasons, AreAppended) {
  v1::GetStatusReply reply;
  add_count(*reply.mutable_refused_by_reason(), Reason::CORRUPT, 3);
  add_count(*reply.mutable_refused_by_reason(), Reason::BAD_SIZE, 1);
  ASSERT_EQ(reply.refused_by_reason_size(), 2);
  EXPECT_EQ(reply.refused_by_reason(0).reason(), v1::REASON_CORRUPT);
  EXPECT_EQ(reply.refused_by_reason(0).count(), 3u);
  EXPECT_EQ(reply.refused_by_reason(1).reason(), v1::REASON_BAD_SIZE);
}

map::EdgeChange change(EdgeId id, std::optional<storage::Edge> before, std::optional<storage::Edge> after) {
  map::EdgeChange change;
  change.id = id;
  change.a = {id.frame.session, id.frame.index - 1};
  change.b = id.frame;
  change.kind = id.ordinal == 0 ? storage::EdgeKind::kOdometry : storage::EdgeKind::kLoop;
  if (before) change.before.emplace(*before);
  if (after) change.after.emplace(*after);
  return change;
}
storage::Edge standing(storage::EdgeState state, Reason reason, bool carries = true) {
  storage::Edge edge;
  edge.state = state;
  edge.reason = reason;
  edge.carries = carries;
  return edge;
}
storage::Edge carried_by(std::vector<EdgeId> closures) {
  storage::Edge edge;
  edge.carried_by = std::move(closures);
  return edge;
}

constexpr EdgeId kClosure{{1, 50}, 1}, kOther{{1, 60}, 1};
const storage::Edge kLone = standing(storage::EdgeState::kCandidate, Reason::LONE, false);
const storage::Edge kDecided = standing(storage::EdgeState::kAccepted, Reason::ACCEPTED_BY_OPERATOR);

TEST(EditEffect, TellsStatesReasonsAndEdgesBeforeAndAfter) {
  const auto message = effect_message({change(kClosure, kLone, kDecided), change(kOther, std::nullopt, kLone)});
  ASSERT_EQ(message.closures_size(), 2);
  EXPECT_EQ(message.closures(0).before(), v1::EDGE_STATE_CANDIDATE);
  EXPECT_EQ(message.closures(0).after(), v1::EDGE_STATE_ACCEPTED);
  EXPECT_EQ(message.closures(0).reason_after(), v1::REASON_ACCEPTED_BY_OPERATOR);
  EXPECT_FALSE(message.closures(0).edge_before());
  EXPECT_TRUE(message.closures(0).edge_after());
  EXPECT_EQ(message.closures(1).before(), v1::EDGE_STATE_UNSPECIFIED) << "it was not there";
}

TEST(EditEffect, NamesTheStretchesAlongWhichTheRobotCountsAsCarried) {
  std::vector<map::EdgeChange> changes;
  for (const std::uint32_t i : {11u, 12u, 13u})
    changes.push_back(change({{1, i}, 0}, carried_by({}), carried_by({kClosure})));
  changes.push_back(change({{1, 14}, 0}, carried_by({kOther}), carried_by({kOther, kClosure})));
  changes.push_back(change({{1, 30}, 0}, carried_by({kOther}), carried_by({})));
  const auto message = effect_message(changes);
  EXPECT_EQ(message.closures_size(), 0);
  ASSERT_EQ(message.carried_size(), 1);
  EXPECT_EQ(message.carried(0).first().index(), 10u);
  EXPECT_EQ(message.carried(0).last().index(), 13u) << "on from there it counted as carried before";
  EXPECT_EQ(message.carried(0).closures_size(), 1);
  ASSERT_EQ(message.not_carried_size(), 1);
  EXPECT_EQ(message.not_carried(0).first().index(), 29u);
}

TEST(EdgeMessage, HoldsUniquenessAndCarryingClosures) {
  storage::Edge edge;
  EXPECT_FALSE(edge_message(edge, 0).has_uniqueness()) << "it is not known";
  edge.uniqueness.known = true;
  EXPECT_TRUE(edge_message(edge, 0).has_uniqueness());
  EXPECT_FALSE(edge_message(edge, 0).uniqueness().has_runner_up());
  EXPECT_FALSE(edge_message(edge, 0).uniqueness().has_differs());
  edge.uniqueness = {true, {2, 3}, 21, 0.25f, 2, 0.5f, 30, 4};
  edge.carried_by = {kClosure, kOther};
  const v1::Edge message = edge_message(edge, 0);
  EXPECT_EQ(message.uniqueness().runner_up().index(), 3u);
  EXPECT_EQ(message.uniqueness().runner_up_inliers(), 21u);
  EXPECT_EQ(message.uniqueness().runner_up_probability(), 0.25);
  EXPECT_EQ(message.uniqueness().alike(), 2u);
  EXPECT_EQ(message.uniqueness().differs(), 0.5);
  EXPECT_EQ(message.uniqueness().compared(), 30u);
  EXPECT_EQ(message.uniqueness().changed(), 4u);
  EXPECT_EQ(message.carried_by_size(), 2);
}

}  // namespace
}  // namespace relmap::rpc
