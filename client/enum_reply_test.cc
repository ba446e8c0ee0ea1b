// What a daemon of a later version, or a broken one, may say where the client knows a few values only.
#include "client/enum_reply.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "client/replies.h"
#include "proto/wire/convert.h"
#include "relmap/v1/evidence.pb.h"
#include "relmap/v1/map.pb.h"
#include "relmap/v1/skeleton.pb.h"
#include "relmap/v1/watch.pb.h"

namespace relmap::client {
namespace {

using ::testing::HasSubstr;

constexpr int kUnknown = 256 + 1;  // which as a byte is a value that is known

template <typename Enum>
constexpr Enum unknown() {
  return static_cast<Enum>(kUnknown);
}

v1::Edge an_edge() {
  v1::Edge edge;
  *edge.mutable_a_from_b() = to_wire(SE3());
  edge.set_kind(v1::EDGE_KIND_LOOP);
  edge.set_state(v1::EDGE_STATE_ACCEPTED);
  edge.set_verification(v1::VERIFICATION_COMPOUNDED);
  edge.add_history()->set_state(v1::EDGE_STATE_REMOVED);
  edge.mutable_suspicion()->add_doubts()->set_kind(v1::DOUBT_KIND_UNSEEN);
  return edge;
}

TEST(EnumReply, NumbersAreThoseOfTheProtocol) {
  const auto count = [](auto wire, auto value) {
    int known = 0;
    for (int number = -1; number < 300; ++number)
      known += read_enum(static_cast<decltype(wire)>(number), value).ok() ? 1 : 0;
    return known;
  };
  // Of the protocol, without "unspecified" where that means nothing.
  EXPECT_EQ(count(v1::EdgeKind(), EdgeKind()), v1::EdgeKind_descriptor()->value_count() - 1);
  EXPECT_EQ(count(v1::EdgeState(), EdgeState()), v1::EdgeState_descriptor()->value_count() - 1);
  EXPECT_EQ(count(v1::DoubtKind(), DoubtKind()), v1::DoubtKind_descriptor()->value_count() - 1);
  EXPECT_EQ(count(v1::Verification(), Verification()), v1::Verification_descriptor()->value_count());
  EXPECT_EQ(count(v1::MotionSource(), MotionSource()), v1::MotionSource_descriptor()->value_count());
  EXPECT_EQ(count(v1::SessionState(), SessionState()), v1::SessionState_descriptor()->value_count());
  EdgeState state = EdgeState::kAccepted;
  EXPECT_TRUE(read_enum(v1::EDGE_STATE_QUARANTINED, state).ok());
  EXPECT_EQ(state, EdgeState::kQuarantined);
  const Status refused = read_enum(unknown<v1::EdgeState>(), state);
  EXPECT_EQ(refused.reason(), Reason::CORRUPT);
  EXPECT_EQ(refused.message(),
            "the daemon's state of an edge is not known here: 257; the daemon may be newer than this client");
  EXPECT_EQ(state, EdgeState::kQuarantined);
}

TEST(EnumReply, AnEventWithAnUnknownValueIsCorrupt) {
  const auto refused = [](const std::function<void(v1::MapEvent&)>& spoil) {
    v1::MapEvent event;
    spoil(event);
    return read_event(event).reason();
  };
  EXPECT_EQ(refused([](v1::MapEvent& e) { e.mutable_session_changed()->set_state(v1::SESSION_STATE_FROZEN); }),
            Reason::OK);
  EXPECT_EQ(refused([](v1::MapEvent& e) { e.mutable_session_changed()->set_state(unknown<v1::SessionState>()); }),
            Reason::CORRUPT);
  const auto added = [](v1::MotionSource source) {
    return [source](v1::MapEvent& event) {
      v1::AddedFrame& frame = *event.mutable_frames_added()->add_frames();
      *frame.mutable_frame() = to_wire(FrameId{1, 2});
      frame.set_source(source);
    };
  };
  EXPECT_EQ(refused(added(v1::MOTION_SOURCE_UNSENSED)), Reason::OK);
  EXPECT_EQ(refused(added(unknown<v1::MotionSource>())), Reason::CORRUPT);
  EXPECT_EQ(refused([](v1::MapEvent& e) { *e.mutable_edge_changed() = an_edge(); }), Reason::OK);
  EXPECT_EQ(refused([](v1::MapEvent& e) {
              *e.mutable_edge_changed() = an_edge();
              e.mutable_edge_changed()->set_state(unknown<v1::EdgeState>());
            }),
            Reason::CORRUPT);
  // Of reasons, what is not known is INTERNAL.
  v1::MapEvent skipped;
  skipped.mutable_skipped()->set_reason(unknown<v1::Reason>());
  const auto read = read_event(skipped).or_throw();
  EXPECT_EQ(std::get<SequencesSkipped>(read->what).reason, reason_from_wire(kUnknown));
}

TEST(EnumReply, AnEdgeWithAnUnknownValueIsCorrupt) {
  EXPECT_TRUE(read_edge(an_edge()).ok());
  const std::vector<std::function<void(v1::Edge&)>> spoils{
      [](v1::Edge& edge) { edge.set_kind(unknown<v1::EdgeKind>()); },
      [](v1::Edge& edge) { edge.set_kind(v1::EDGE_KIND_UNSPECIFIED); },
      [](v1::Edge& edge) { edge.set_state(unknown<v1::EdgeState>()); },
      [](v1::Edge& edge) { edge.set_source(unknown<v1::MotionSource>()); },
      [](v1::Edge& edge) { edge.set_verification(unknown<v1::Verification>()); },
      [](v1::Edge& edge) { edge.mutable_history(0)->set_state(unknown<v1::EdgeState>()); },
  };
  for (std::size_t i = 0; i < spoils.size(); ++i) {
    v1::Edge edge = an_edge();
    spoils[i](edge);
    const auto read = read_edge(edge);
    EXPECT_EQ(read.reason(), Reason::CORRUPT) << i;
    EXPECT_THAT(read.status().message(), HasSubstr("is not known here: ")) << i;
  }
}

// A watch would end for good with the first closure that a newer daemon doubts for another reason.
TEST(EnumReply, DoubtsOfAnUnknownKindAreLeftOut) {
  v1::Edge edge = an_edge();
  edge.mutable_suspicion()->set_value(0.5);
  for (const v1::DoubtKind kind : {unknown<v1::DoubtKind>(), v1::DOUBT_KIND_UNSPECIFIED, v1::DOUBT_KIND_LONELY})
    edge.mutable_suspicion()->add_doubts()->set_kind(kind);
  const auto read = read_edge(edge);
  ASSERT_TRUE(read.ok()) << read.status().to_string();
  EXPECT_EQ(read->suspicion->value, 0.5);
  ASSERT_EQ(read->suspicion->doubts.size(), 2u);
  EXPECT_EQ(read->suspicion->doubts[0].kind, DoubtKind::kUnseen);
  EXPECT_EQ(read->suspicion->doubts[1].kind, DoubtKind::kLonely);
  v1::MapEvent event;
  *event.mutable_edge_changed() = edge;
  EXPECT_TRUE(read_event(event).ok());
}

TEST(EnumReply, WhatAnEditChangesHasAStateOrNone) {
  v1::EditEffect effect;
  v1::ClosureChange& change = *effect.add_closures();
  change.set_after(v1::EDGE_STATE_REMOVED);
  const auto read = read_effect(effect);
  ASSERT_TRUE(read.ok()) << read.status().to_string();
  EXPECT_EQ(read->closures.at(0).before, std::nullopt) << "it did not exist";
  EXPECT_EQ(read->closures.at(0).after, EdgeState::kRemoved);
  change.set_before(unknown<v1::EdgeState>());
  EXPECT_EQ(read_effect(effect).reason(), Reason::CORRUPT);
  change.set_before(v1::EDGE_STATE_UNSPECIFIED);
  change.set_after(unknown<v1::EdgeState>());
  EXPECT_EQ(read_effect(effect).reason(), Reason::CORRUPT);
}

TEST(EnumReply, AClosureOfASkeletonHasAStateAndStandsForOneAtLeast) {
  v1::GetSkeletonReply reply;
  v1::SkeletonClosures& told = *reply.mutable_closures();
  told.add_session_b(1);
  told.add_index_b(5);
  told.add_ordinal(1);
  told.add_session_a(1);
  told.add_index_a(2);
  told.add_state(v1::EDGE_STATE_ACCEPTED);
  told.add_carries(true);
  for (int i = 0; i < 6; ++i) told.add_a_from_b(0);
  for (int i = 0; i < 2; ++i) told.add_variance(0);
  told.add_suspicion(0);
  told.add_alike(1);
  const auto read = [&] {
    Skeleton skeleton;
    return read_skeleton_part(reply, skeleton);
  };
  EXPECT_TRUE(read().ok());
  told.set_state(0, unknown<v1::EdgeState>());
  EXPECT_EQ(read().reason(), Reason::CORRUPT);
  EXPECT_THAT(read().message(), HasSubstr("state of an edge is not known here: 257"));
  told.set_state(0, v1::EDGE_STATE_ACCEPTED);
  told.set_alike(0, 0);
  EXPECT_EQ(read().reason(), Reason::CORRUPT);
}

TEST(EnumReply, OtherRepliesWithAnUnknownValueAreCorrupt) {
  v1::LocaliseReply localised;
  *localised.mutable_frame_from_view() = to_wire(SE3());
  EXPECT_TRUE(read_localisation(localised).ok());
  localised.set_verification(unknown<v1::Verification>());
  EXPECT_EQ(read_localisation(localised).reason(), Reason::CORRUPT);

  v1::MatchImageReply matched;
  EXPECT_TRUE(read_matches(matched).ok());
  matched.add_places()->set_verification(unknown<v1::Verification>());
  EXPECT_EQ(read_matches(matched).reason(), Reason::CORRUPT);

  v1::ExplainEdgeReply explained;
  *explained.mutable_edge() = an_edge();
  explained.add_agreements()->set_state(v1::EDGE_STATE_CANDIDATE);
  EXPECT_TRUE(read_explanation(explained).ok());
  explained.mutable_agreements(0)->set_state(unknown<v1::EdgeState>());
  EXPECT_EQ(read_explanation(explained).reason(), Reason::CORRUPT);

  v1::FindRouteReply route;
  v1::RouteStep& step = *route.add_steps();
  *step.mutable_edge() = to_wire(EdgeId{{1, 2}, 0});
  *step.mutable_to_next() = to_wire(SE3());
  step.set_kind(v1::EDGE_KIND_ODOMETRY);
  Route read;
  EXPECT_TRUE(read_route_reply(route, read).ok());
  route.mutable_steps(0)->set_kind(unknown<v1::EdgeKind>());
  EXPECT_EQ(read_route_reply(route, read).reason(), Reason::CORRUPT);
}

}  // namespace
}  // namespace relmap::client
