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

}  // namespace
}  // namespace relmap::map
