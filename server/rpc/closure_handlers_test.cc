#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/base/clock.h"
#include "proto/wire/convert.h"
#include "relmap/v1/map.pb.h"
#include "server/rpc/handlers.h"
#include "server/rpc/request_context.h"
#include "server/rpc/testing/served_map.h"

namespace relmap::rpc {
namespace {

using testing::HasSubstr;

map::MapperOptions without_lookup() {
  map::MapperOptions options;
  options.closures = false;
  return options;
}

// Recognition is off: the only closures are those that a test proposes.
class ClosureHandlers : public testing::Test {
 protected:
  static v1::ProposeEdgeRequest between(FrameId a, FrameId b, bool dry_run = false) {
    v1::ProposeEdgeRequest request;
    *request.mutable_a() = to_wire(a);
    *request.mutable_b() = to_wire(b);
    request.set_dry_run(dry_run);
    return request;
  }
  static v1::SetEdgeStateRequest edit(const v1::EdgeId& id, v1::EdgeState state, bool decided = false) {
    v1::SetEdgeStateRequest request;
    *request.mutable_edge() = id;
    request.set_state(state);
    request.set_decided(decided);
    return request;
  }
  Result<v1::ProposeEdgeReply> propose(const v1::ProposeEdgeRequest& request) {
    return call(*map_.core, propose_edge, request, deadline_);
  }
  // First makes a dry run, which must report the same changes and change nothing.
  v1::SetEdgeStateReply set(v1::SetEdgeStateRequest request) {
    map_.settle();
    const std::uint64_t version = map_.mapper->view()->version();
    request.set_dry_run(true);
    const auto dry = call(*map_.core, set_edge_state, request, deadline_).or_throw();
    EXPECT_EQ(dry.journal_sequence(), 0u);
    EXPECT_EQ(map_.mapper->view()->version(), version);
    request.set_dry_run(false);
    auto done = call(*map_.core, set_edge_state, request, deadline_).or_throw();
    EXPECT_GT(done.journal_sequence(), 0u);
    EXPECT_EQ(done.effect().SerializeAsString(), dry.effect().SerializeAsString());
    EXPECT_EQ(done.edge().state(), dry.edge().state());
    EXPECT_EQ(done.also_changed_size(), dry.also_changed_size());
    return done;
  }
  std::uint64_t sequence() { return map_.mapper->stats().durable_sequence; }

  ServedMap map_{RpcLimits(), without_lookup()};
  Deadline deadline_;
};

constexpr FrameId kEarly{1, 4}, kLate{1, 44};  // one lap apart

TEST_F(ClosureHandlers, AClosureFoundByGeometryIsProposedAndJudged) {
  const auto dry = propose(between(kLate, kEarly, true)).or_throw();
  const std::uint64_t before = sequence();
  EXPECT_EQ(dry.journal_sequence(), 0u);

  v1::ProposeEdgeRequest request = between(kLate, kEarly);
  request.set_idempotency_key("once");
  const auto first = propose(request).or_throw();
  EXPECT_EQ(first.journal_sequence(), before + 1) << "the dry run wrote nothing";
  EXPECT_EQ(first.edge().state(), v1::EDGE_STATE_CANDIDATE);
  EXPECT_EQ(first.edge().reason(), v1::REASON_LONE);
  EXPECT_EQ(first.edge().verification(), v1::VERIFICATION_STEREO);
  EXPECT_GE(first.edge().inliers(), 20u);
  EXPECT_GT(first.edge().bound(), 0u);
  EXPECT_EQ(first.effect().SerializeAsString(), dry.effect().SerializeAsString());
  const FrameId match = from_wire(first.edge().a()).or_throw(), query = from_wire(first.edge().b()).or_throw();
  EXPECT_EQ(query, kLate) << "stored with the newer, in whatever order they were named";
  const SE3 truth = map_.circuit.T_world_frame(match.index).inverse() * map_.circuit.T_world_frame(query.index);
  const SE3 error = truth.inverse() * from_wire(first.edge().a_from_b()).or_throw();
  EXPECT_LT(error.t.norm(), 0.1);

  const auto same = propose(request).or_throw();
  EXPECT_EQ(same.journal_sequence(), first.journal_sequence()) << "the same edit again";
  EXPECT_EQ(same.edge().SerializeAsString(), first.edge().SerializeAsString());
  const Status again = propose(between(kEarly, kLate)).status();
  EXPECT_EQ(again.reason(), Reason::WRONG_STATE);
  EXPECT_THAT(again.message(), HasSubstr(from_wire(first.edge().id()).or_throw().to_string()));

  const auto second = propose(between({1, 6}, {1, 46})).or_throw();
  EXPECT_EQ(second.edge().state(), v1::EDGE_STATE_ACCEPTED);
  EXPECT_EQ(second.edge().reason(), v1::REASON_CONSISTENT);
  ASSERT_EQ(second.effect().closures_size(), 2) << "it confirms the first";
  EXPECT_EQ(second.effect().closures(0).before(), v1::EDGE_STATE_CANDIDATE);
  EXPECT_EQ(second.effect().closures(1).before(), v1::EDGE_STATE_UNSPECIFIED);
}

TEST_F(ClosureHandlers, TheHistorySaysWhenAndByWhom) {
  const std::int64_t before = now_us();
  const auto found = [&] {
    const RequestContext ann{"1", "", "ann"};
    const RequestScope scope(ann);
    v1::ProposeEdgeRequest request = between(kEarly, kLate);
    request.set_accept(true);
    return propose(request).or_throw().edge();
  }();
  ASSERT_EQ(found.history_size(), 2);
  for (const v1::EdgeEvent& event : found.history()) {
    EXPECT_EQ(event.author(), "ann");
    EXPECT_GE(event.time_us(), before);
    EXPECT_LE(event.time_us(), now_us());
  }
  const auto removed = [&] {
    const RequestContext long_name{"2", "", std::string(1000, 'x')};
    const RequestScope scope(long_name);
    return set(edit(found.id(), v1::EDGE_STATE_REMOVED)).edge();
  }();
  EXPECT_EQ(removed.history(2).author(), std::string(storage::kMaxAuthorBytes, 'x'));
  const auto restored = set(edit(found.id(), v1::EDGE_STATE_ACCEPTED)).edge();
  EXPECT_EQ(restored.history(3).author(), "relmapd") << "no caller did it";
}

TEST_F(ClosureHandlers, AProposalMayBePutIntoForceAtOnce) {
  v1::ProposeEdgeRequest request = between(kEarly, kLate, true);
  request.set_accept(true);
  request.set_note("I was there");
  const auto dry = propose(request).or_throw();
  EXPECT_EQ(dry.edge().reason(), v1::REASON_ACCEPTED_BY_OPERATOR);
  request.set_dry_run(false);
  request.set_idempotency_key("once");
  const auto done = propose(request).or_throw();
  EXPECT_EQ(done.edge().state(), v1::EDGE_STATE_ACCEPTED);
  EXPECT_EQ(done.edge().history(1).note(), "I was there");
  EXPECT_EQ(done.effect().SerializeAsString(), dry.effect().SerializeAsString());
  ASSERT_EQ(done.effect().closures_size(), 1);
  EXPECT_EQ(done.effect().closures(0).before(), v1::EDGE_STATE_UNSPECIFIED) << "both records in one";
  EXPECT_TRUE(done.effect().closures(0).edge_after());
  EXPECT_EQ(propose(request).or_throw().journal_sequence(), done.journal_sequence());
}

TEST_F(ClosureHandlers, ARefusedProposalNamesItsReason) {
  const Status elsewhere = propose(between({1, 10}, ServedMap::kUnconnected)).status();
  EXPECT_EQ(elsewhere.reason(), Reason::TOO_FEW_INLIERS);
  EXPECT_THAT(elsewhere.message(), HasSubstr("2:3 at 1:10: "));
  EXPECT_THAT(elsewhere.message(), HasSubstr("1:10 at 2:3: TOO_FEW_INLIERS: ")) << "both directions";
  EXPECT_EQ(propose(between({1, 10}, {1, 10})).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(propose(between({1, 10}, {1, 12})).reason(), Reason::INVALID_ARGUMENT) << "its own recent past";
  EXPECT_EQ(propose(between({1, 10}, {7, 12})).reason(), Reason::NO_SUCH_FRAME);
  EXPECT_EQ(propose({}).reason(), Reason::INVALID_ARGUMENT);
  const SessionNumber one_eye = map_.take_in_with_one_eye(3);
  EXPECT_EQ(propose(between({1, 1}, {one_eye, 1})).reason(), Reason::NOT_STEREO);
  v1::ProposeEdgeRequest long_note = between(kEarly, kLate);
  long_note.set_note(std::string(2000, 'x'));
  EXPECT_EQ(propose(long_note).reason(), Reason::INVALID_ARGUMENT);
  long_note.set_note("red\x1b[31m");  // would colour the terminal of whoever reads it
  EXPECT_EQ(propose(long_note).reason(), Reason::INVALID_ARGUMENT);
}

TEST_F(ClosureHandlers, EachEditReportsItsChangesAndCanBeUndone) {
  const auto id = propose(between(kEarly, kLate)).or_throw().edge().id();
  const auto accepted = set(edit(id, v1::EDGE_STATE_ACCEPTED, true));
  EXPECT_EQ(accepted.edge().reason(), v1::REASON_ACCEPTED_BY_OPERATOR);
  ASSERT_EQ(accepted.effect().closures_size(), 1);
  EXPECT_TRUE(accepted.effect().closures(0).edge_after());
  EXPECT_GT(accepted.effect().closures(0).bound_frames(), 0u);

  const auto other = propose(between({1, 6}, {1, 46})).or_throw();
  EXPECT_EQ(other.edge().state(), v1::EDGE_STATE_ACCEPTED);
  const auto removed = set(edit(id, v1::EDGE_STATE_REMOVED));
  EXPECT_EQ(removed.effect().closures_size(), 2);
  ASSERT_EQ(removed.also_changed_size(), 1);
  EXPECT_EQ(removed.also_changed(0).SerializeAsString(), other.edge().id().SerializeAsString());
  const auto restored = set(edit(id, v1::EDGE_STATE_ACCEPTED));
  EXPECT_EQ(restored.edge().reason(), v1::REASON_ACCEPTED_BY_OPERATOR) << "as it was";
  const auto withdrawn = set(edit(id, v1::EDGE_STATE_CANDIDATE));
  EXPECT_EQ(withdrawn.edge().reason(), v1::REASON_LONE);
  EXPECT_EQ(call(*map_.core, set_edge_state, edit(id, v1::EDGE_STATE_CANDIDATE), deadline_).reason(),
            Reason::WRONG_STATE);
  EXPECT_EQ(call(*map_.core, set_edge_state, edit(id, v1::EDGE_STATE_REMOVED, true), deadline_).reason(),
            Reason::UNSUPPORTED);
}

// Another closure comes into force between the dry run and the removal.
TEST_F(ClosureHandlers, ARemovalIsBoundToWhatItsDryRunShowed) {
  const auto id = propose(between(kEarly, kLate)).or_throw().edge().id();
  ASSERT_EQ(propose(between({1, 6}, {1, 46})).or_throw().edge().state(), v1::EDGE_STATE_ACCEPTED);
  v1::SetEdgeStateRequest request = edit(id, v1::EDGE_STATE_REMOVED);
  request.set_dry_run(true);
  const auto looked = call(*map_.core, set_edge_state, request, deadline_).or_throw();
  EXPECT_NE(looked.shown(), 0u);
  ASSERT_EQ(propose(between({1, 8}, {1, 48})).or_throw().edge().state(), v1::EDGE_STATE_ACCEPTED);
  const std::uint64_t before = sequence();

  request.set_dry_run(false);
  request.set_shown(looked.shown());
  const Status refused = call(*map_.core, set_edge_state, request, deadline_).status();
  EXPECT_EQ(refused.reason(), Reason::WRONG_STATE);
  EXPECT_THAT(refused.message(), HasSubstr("look again"));
  EXPECT_EQ(sequence(), before) << "nothing is written";

  request.set_dry_run(true);
  request.set_shown(0);
  const auto again = call(*map_.core, set_edge_state, request, deadline_).or_throw();
  EXPECT_EQ(again.effect().closures_size(), 3);
  request.set_dry_run(false);
  request.set_shown(again.shown());
  const auto done = call(*map_.core, set_edge_state, request, deadline_).or_throw();
  EXPECT_EQ(done.effect().SerializeAsString(), again.effect().SerializeAsString());
  EXPECT_EQ(done.shown(), 0u);

  v1::SetEdgeStateRequest other = edit(id, v1::EDGE_STATE_ACCEPTED);
  other.set_shown(again.shown());
  EXPECT_EQ(call(*map_.core, set_edge_state, other, deadline_).reason(), Reason::INVALID_ARGUMENT);
  other = edit(id, v1::EDGE_STATE_REMOVED);
  other.set_alone(true);
  other.set_shown(again.shown());
  EXPECT_EQ(call(*map_.core, set_edge_state, other, deadline_).reason(), Reason::INVALID_ARGUMENT);
}

}  // namespace
}  // namespace relmap::rpc
