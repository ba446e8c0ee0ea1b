#include "server/map/edge_changes.h"

#include <gtest/gtest.h>

namespace relmap::map {
namespace {

constexpr EdgeId kClosure{{1, 50}, 1}, kOther{{1, 60}, 1};

EdgeStanding in_state(storage::EdgeState state) {
  storage::Edge edge;
  edge.state = state;
  return EdgeStanding(edge);
}
EdgeChange change(EdgeId id, std::optional<EdgeStanding> before, std::optional<EdgeStanding> after) {
  EdgeChange change;
  change.id = id;
  change.before = std::move(before);
  change.after = std::move(after);
  return change;
}
const EdgeStanding kCandidate = in_state(storage::EdgeState::kCandidate);
const EdgeStanding kInForce = in_state(storage::EdgeState::kAccepted);

TEST(EdgeChanges, TwoEditsCombineFromBeforeTheFirstToAfterTheSecond) {
  const auto both = combined({change(kOther, kInForce, kCandidate), change(kClosure, std::nullopt, kCandidate)},
                             {change(kOther, kCandidate, kInForce), change(kClosure, kCandidate, kInForce)});
  ASSERT_EQ(both.size(), 1u) << "the other is what it was";
  EXPECT_EQ(both[0].id, kClosure);
  EXPECT_FALSE(both[0].before);
  EXPECT_EQ(both[0].after->state, storage::EdgeState::kAccepted);
}

TEST(EdgeChanges, ChangesOfOneEditOnlyAreKeptInOrder) {
  const auto both = combined({change(kOther, kInForce, kCandidate)}, {change(kClosure, kCandidate, kInForce)});
  ASSERT_EQ(both.size(), 2u);
  EXPECT_EQ(both[0].id, kClosure);
  EXPECT_EQ(both[1].id, kOther);
}

TEST(EdgeChanges, AlsoChangedAreClosuresThatTheEditDidNotName) {
  EdgeStanding other_reason = kInForce;
  other_reason.reason = Reason::ACCEPTED_BY_OPERATOR;
  EdgeChange step = change({{1, 70}, 0}, kCandidate, kInForce);
  step.kind = storage::EdgeKind::kOdometry;
  const std::vector<EdgeChange> changes = {
      change(kClosure, kCandidate, kInForce),         change(kOther, kInForce, kCandidate),
      change({{1, 61}, 1}, std::nullopt, kCandidate), change({{1, 62}, 1}, kCandidate, std::nullopt),
      change({{1, 63}, 1}, kInForce, other_reason),   step};
  EXPECT_EQ(also_changed(changes, kClosure), std::vector<EdgeId>{kOther});
  EXPECT_EQ(also_changed(changes, kOther), std::vector<EdgeId>{kClosure});
}

TEST(EdgeChanges, OnlyWhereNothingSaidSoBeforeAStretchBecomesCarried) {
  const auto carried_by = [](std::vector<EdgeId> closures) {
    EdgeStanding standing = kInForce;
    standing.carried_by = std::move(closures);
    return standing;
  };
  const auto step = [](std::uint32_t index, std::optional<EdgeStanding> before, std::optional<EdgeStanding> after) {
    EdgeChange made = change({{1, index}, 0}, std::move(before), std::move(after));
    made.a = {1, index - 1};
    made.b = {1, index};
    made.kind = storage::EdgeKind::kOdometry;
    return made;
  };
  EdgeChange closure = step(40, std::nullopt, carried_by({kOther}));
  closure.kind = storage::EdgeKind::kLoop;
  const CarryingChanges stretches = carrying_changes({step(11, carried_by({}), carried_by({kClosure})),
                                                      step(12, std::nullopt, carried_by({kClosure})),
                                                      step(13, carried_by({kOther}), carried_by({kOther, kClosure})),
                                                      step(30, carried_by({kOther}), carried_by({})), closure});
  ASSERT_EQ(stretches.carried.list().size(), 1u);
  EXPECT_EQ(stretches.carried.list()[0], (route::CarriedStretch{{1, 10}, {1, 12}, {kClosure}}));
  ASSERT_EQ(stretches.not_carried.list().size(), 1u);
  EXPECT_EQ(stretches.not_carried.list()[0], (route::CarriedStretch{{1, 29}, {1, 30}, {kOther}}));
}

}  // namespace
}  // namespace relmap::map
