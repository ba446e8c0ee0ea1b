#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <utility>

#include "proto/wire/convert.h"
#include "relmap/v1/map.pb.h"
#include "server/rpc/handlers.h"
#include "storage/engine/memory_engine.h"

namespace relmap::rpc {
namespace {

constexpr std::uint32_t kLap = 40, kFrames = 60;

// A circuit of 40 frames that is driven one and a half times.
SE3 pose(std::uint32_t index) {
  const double angle = 2 * std::numbers::pi * index / kLap;
  return {so3_exp({0, angle, 0}), {10 * (1 - std::cos(angle)), 0, 10 * std::sin(angle)}};
}

class ImportGraph : public ::testing::Test {
 protected:
  v1::ImportGraphRequest piece(std::uint32_t first, std::uint32_t end) const {
    v1::ImportGraphRequest request;
    request.set_session_uuid(std::string(16, '\7'));
    request.set_robot("imported");
    request.set_name("circuit");
    request.set_first(first);
    for (std::uint32_t i = first; i < end; ++i) {
      v1::ImportedFrame& frame = *request.add_frames();
      *frame.mutable_odom_from_frame() = to_wire(pose(i));
      if (i > 0) *frame.mutable_step() = to_wire(Matrix6(1e-4 * Matrix6::Identity()));
      frame.set_time_us(1'000'000 * (i + 1));
      frame.set_driven_us(1'000'000);
    }
    return request;
  }
  static void add_loop(v1::ImportGraphRequest& request, std::uint32_t query, std::uint32_t match, const SE3& T) {
    v1::ImportedLoop& loop = *request.add_loops();
    loop.set_query(query);
    loop.set_match(match);
    *loop.mutable_match_from_query() = to_wire(T);
    *loop.mutable_covariance() = to_wire(Matrix6(1e-4 * Matrix6::Identity()));
  }
  Result<v1::ImportGraphReply> import(const v1::ImportGraphRequest& request) {
    return call(core_, import_graph, request, {});
  }
  // Returns the whole stream as one message.
  static v1::FindRouteReply route(Core& core, const v1::FindRouteRequest& request) {
    v1::FindRouteReply whole;
    auto stream = call(core, find_route, request, {}).or_throw();
    for (auto part = stream().or_throw(); part; part = stream().or_throw()) whole.MergeFrom(*part);
    return whole;
  }
  void make_cells(Core& core) const {
    core.routes.index = std::make_unique<route::RouteIndex>(
        route::RouteIndexOptions{}, [this] { return mapper_->view(); },
        std::make_shared<storage::Budget>(std::size_t{64} << 20));
    core.routes.index->start();
    ASSERT_TRUE(core.routes.index->wait_current(std::chrono::steady_clock::now() + std::chrono::minutes(10)));
  }
  std::vector<storage::Edge> loops() const {
    std::vector<storage::Edge> found;
    for (std::uint32_t i = 0; i < kFrames; ++i)
      if (const auto hot = mapper_->view()->hot({1, i}))
        for (const storage::Edge& edge : hot->edges)
          if (edge.kind == storage::EdgeKind::kLoop) found.push_back(edge);
    return found;
  }

  std::unique_ptr<map::Mapper> mapper_ =
      map::Mapper::open(storage::make_memory_engine(), std::make_shared<storage::Budget>(std::size_t{64} << 20),
                        nullptr, {})
          .or_throw();
  Core core_{*mapper_, DaemonFacts{"test", "b007b007b007", "/data", "", false, 4711, 0}, {}};
};

TEST_F(ImportGraph, LoopsThatAgreeCloseTheCircuit) {
  ASSERT_TRUE(import(piece(0, 30)).ok());
  auto rest = piece(30, kFrames);
  for (const std::uint32_t query : {45, 50, 55}) add_loop(rest, query, query - kLap, SE3());
  add_loop(rest, 58, 4, SE3(Matrix3::Identity(), {3, 0, 0}));  // false
  const auto reply = import(rest);
  ASSERT_TRUE(reply.ok()) << reply.status().to_string();
  EXPECT_EQ(reply->session(), 1u);
  EXPECT_EQ(reply->frames_known(), 0u);

  const auto session = mapper_->view()->session(1);
  ASSERT_TRUE(session.has_value());
  EXPECT_EQ(session->frames, kFrames);
  EXPECT_EQ(session->header.name, "circuit");
  const auto found = loops();
  ASSERT_EQ(found.size(), 4u);
  for (const storage::Edge& loop : found) {
    EXPECT_EQ(loop.state == storage::EdgeState::kAccepted, loop.b.index != 58u) << loop.id.to_string();
    EXPECT_EQ(loop.verification, storage::Verification::kImported);
  }
  EXPECT_TRUE(found[0].carries) << "it is a way of the graph";

  // Importing the same again changes nothing.
  const auto again = import(rest);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->frames_known(), kFrames - 30);
  EXPECT_EQ(mapper_->view()->session(1)->frames, kFrames);
  EXPECT_EQ(loops().size(), 4u);
}

TEST_F(ImportGraph, AnUnknownStepIsTrustedLittle) {
  auto request = piece(0, 10);
  request.mutable_frames(5)->clear_step();
  ASSERT_TRUE(import(request).ok());
  const auto hot = mapper_->view()->hot({1, 5});
  ASSERT_TRUE(hot);
  EXPECT_EQ(hot->edges.at(0).source, MotionSource::kUnsensed);
  EXPECT_GT(hot->edges[0].covariance(0, 0), 1);
}

TEST_F(ImportGraph, RoutesAndTransformsListUnmeasuredSteps) {
  constexpr std::uint32_t kFar = 190, kDark = 100;  // in chunks of their own
  auto request = piece(0, kFar + 1);
  request.mutable_frames(kDark)->clear_step();
  ASSERT_TRUE(import(request).ok());
  const double length = mapper_->view()->hot({1, kDark})->edges.at(0).T_ab.t.norm();

  v1::FindRouteRequest way;
  *way.mutable_from()->mutable_frame() = to_wire(FrameId{1, 2});
  *way.mutable_to()->mutable_frame() = to_wire(FrameId{1, kFar});
  const auto expect_told = [&](const auto& told) {
    ASSERT_EQ(told.unmeasured_size(), 1);
    EXPECT_EQ(told.unmeasured(0).first().index(), kDark - 1);
    EXPECT_EQ(told.unmeasured(0).last().index(), kDark);
    EXPECT_EQ(told.unmeasured(0).steps(), 1u);
    EXPECT_NEAR(told.unmeasured(0).distance_m(), length, 1e-9);
    EXPECT_EQ(told.unmeasured_steps(), 1u);
    EXPECT_NEAR(told.unmeasured_m(), length, 1e-9);
  };
  const auto expect_route_told = [&](Core& core) {
    const v1::FindRouteReply reply = route(core, way);
    expect_told(reply.summary());
    ASSERT_EQ(reply.steps_size(), static_cast<int>(kFar - 1));
    for (const v1::RouteStep& step : reply.steps()) EXPECT_EQ(step.unmeasured(), step.frame().index() == kDark - 1);
  };
  expect_route_told(core_);
  Core by_cells(*mapper_, core_.facts, {.near_route_steps = 0});
  make_cells(by_cells);
  EXPECT_EQ(route(by_cells, way).summary().frame_by_frame(), "");
  expect_route_told(by_cells);

  v1::TransformBetweenRequest between;
  *between.mutable_a() = way.from().frame();
  *between.mutable_b() = way.to().frame();
  expect_told(call(core_, transform_between, between, {}).or_throw());
  *between.mutable_b() = to_wire(FrameId{1, kDark - 1});
  EXPECT_EQ(call(core_, transform_between, between, {}).or_throw().unmeasured_steps(), 0u);

  v1::GetNeighbourhoodRequest around;
  *around.mutable_root() = to_wire(FrameId{1, kDark + 1});
  around.set_max_edges(3);
  const v1::GetNeighbourhoodReply near = call(core_, get_neighbourhood, around, {}).or_throw();
  ASSERT_EQ(near.frames_size(), 7);
  for (const v1::NeighbourhoodFrame& frame : near.frames())
    EXPECT_EQ(frame.unmeasured_steps(), frame.frame().index() < kDark ? 1u : 0u);
}

// The other way around the circuit is longer, but not by half.
TEST_F(ImportGraph, AlternativesFollowTheRouteInItsStream) {
  auto request = piece(0, kFrames);
  for (const std::uint32_t query : {45, 50, 55}) add_loop(request, query, query - kLap, SE3());
  ASSERT_TRUE(import(request).ok());
  v1::FindRouteRequest way;
  *way.mutable_from()->mutable_frame() = to_wire(FrameId{1, 10});
  *way.mutable_to()->mutable_frame() = to_wire(FrameId{1, 10 + kLap * 9 / 20});
  way.set_alternatives(3);
  way.set_covariance(true);
  Core by_cells(*mapper_, core_.facts, {.near_route_steps = 0, .route_steps_per_message = 7});
  make_cells(by_cells);
  Core by_frames(*mapper_, core_.facts, {.route_steps_per_message = 7});
  for (Core* core : {&by_cells, &by_frames}) {
    std::vector<v1::FindRouteReply> messages;
    auto stream = call(*core, find_route, way, {}).or_throw();
    for (auto message = stream().or_throw(); message; message = stream().or_throw()) messages.push_back(*message);
    std::vector<v1::RouteSummary> summaries;
    std::vector<std::vector<std::uint32_t>> frames;
    for (const v1::FindRouteReply& message : messages) {
      EXPECT_EQ(message.has_summary(), message.route() == summaries.size());
      if (message.has_summary()) {
        summaries.push_back(message.summary());
        frames.emplace_back();
      }
      ASSERT_EQ(message.route() + 1, summaries.size());
      for (const v1::RouteStep& step : message.steps()) frames.back().push_back(step.frame().index());
      EXPECT_EQ(message.resume_token().empty(), &message == &messages.back());
    }
    ASSERT_EQ(summaries.size(), 2u);
    EXPECT_EQ(summaries[0].shared(), 0);
    EXPECT_LE(summaries[1].shared(), 0.75);
    EXPECT_GT(summaries[1].cost(), summaries[0].cost());
    EXPECT_LE(summaries[1].cost(), 1.5 * summaries[0].cost());
    for (std::size_t i = 0; i < 2; ++i) {
      ASSERT_EQ(frames[i].size(), summaries[i].steps());
      EXPECT_EQ(frames[i].front(), way.from().frame().index());
      EXPECT_EQ(frames[i].back(), way.to().frame().index());
    }
    EXPECT_THAT(frames[0], testing::Contains(20u));
    EXPECT_THAT(frames[1], testing::Not(testing::Contains(20u))) << "the other way around";

    // Each message's token leads on with the next one.
    for (std::size_t i = 0; i + 1 < messages.size(); ++i) {
      v1::FindRouteRequest again = way;
      again.set_resume_token(messages[i].resume_token());
      auto rest = call(*core, find_route, again, {}).or_throw();
      for (std::size_t j = i + 1; j < messages.size(); ++j)
        EXPECT_EQ(rest().or_throw().value().SerializeAsString(), messages[j].SerializeAsString());
      EXPECT_FALSE(rest().or_throw().has_value());
    }
    v1::FindRouteRequest none = way;
    none.clear_alternatives();
    std::size_t alone = 0;
    auto cheapest = call(*core, find_route, none, {}).or_throw();
    for (auto message = cheapest().or_throw(); message; message = cheapest().or_throw()) {
      EXPECT_EQ(message->route(), 0u);
      alone += static_cast<std::size_t>(message->steps_size());
    }
    EXPECT_EQ(alone, frames[0].size());
    none.set_alternatives(6);
    EXPECT_EQ(call(*core, find_route, none, {}).reason(), Reason::INVALID_ARGUMENT);
  }
}

TEST_F(ImportGraph, RoutesNearByPassClosuresThatOnlyBind) {
  auto request = piece(0, kFrames);
  for (const std::uint32_t query : {45, 50, 55}) add_loop(request, query, query - kLap, SE3());
  ASSERT_TRUE(import(request).ok());
  const auto bound = mapper_->view()->hot({1, 50})->edges.at(1);
  ASSERT_TRUE(bound.state == storage::EdgeState::kAccepted && !bound.carries)
      << "the way by the one of frame 45 is short enough";

  v1::FindRouteRequest way;
  *way.mutable_from()->mutable_frame() = to_wire(FrameId{1, 10});
  *way.mutable_to()->mutable_frame() = to_wire(FrameId{1, 50});
  const auto expect_by_closure = [&](Core& core) {
    const v1::FindRouteReply reply = route(core, way);
    ASSERT_EQ(reply.steps_size(), 2);
    EXPECT_EQ(reply.steps(0).edge().ordinal(), bound.id.ordinal);
    EXPECT_EQ(reply.steps(0).kind(), v1::EDGE_KIND_LOOP);
    EXPECT_TRUE(reply.summary().bound_closures());
  };
  expect_by_closure(core_);
  EXPECT_NE(route(core_, way).summary().frame_by_frame(), "") << "there are no cells";
  make_cells(core_);
  expect_by_closure(core_);
  EXPECT_EQ(route(core_, way).summary().frame_by_frame(), "");
  EXPECT_FALSE(route(core_, way).summary().no_way_by_edges());
  Core far(*mapper_, core_.facts, {.near_route_steps = 0});
  make_cells(far);
  EXPECT_EQ(route(far, way).steps_size(), 12) << "cells have no such closure";
  EXPECT_FALSE(route(far, way).summary().bound_closures());
  for (const std::uint64_t steps : {11, 12}) {
    Core short_ways(*mapper_, core_.facts, {.near_route_steps = steps});
    make_cells(short_ways);
    EXPECT_EQ(route(short_ways, way).summary().bound_closures(), steps == 12) << "it has 12 by edges";
  }

  // A broken stream resumes along the same route.
  Core in_pieces(*mapper_, core_.facts, {.route_steps_per_message = 1});
  auto stream = call(in_pieces, find_route, way, {}).or_throw();
  way.set_resume_token(stream().or_throw()->resume_token());
  auto rest = call(in_pieces, find_route, way, {}).or_throw();
  EXPECT_EQ(rest().or_throw()->steps(0).frame().index(), 50u);
  way.clear_resume_token();

  way.mutable_filter()->set_min_support(1);
  EXPECT_EQ(call(core_, find_route, way, {}).reason(), Reason::NOT_CONNECTED);
  way.clear_filter();
  for (const std::uint32_t avoided : {45, 53})  // on either side of it, with the edges there
    *way.mutable_filter()->add_avoid_frames() = to_wire(FrameId{1, avoided});
  expect_by_closure(core_);
  EXPECT_TRUE(route(core_, way).summary().no_way_by_edges());
  const auto expect_refused = [&](Core& core, Reason reason, const Deadline& deadline = {}) {
    const Status without = call(core, find_route, way, deadline).status();
    EXPECT_EQ(without.reason(), reason) << without.message();
    EXPECT_NE(without.message().find("closures that only bind"), std::string::npos);
  };
  expect_refused(far, Reason::NOT_CONNECTED);
  // If only the second search finds no memory, the answer by edges stands.
  std::size_t looks = 0, last = 0;
  const Deadline no_memory_at_last{
      .interrupted = [&]() -> Status { return ++looks == last ? Status(Reason::BUDGET_EXCEEDED, "") : Status(); }};
  expect_refused(far, Reason::NOT_CONNECTED, no_memory_at_last);
  last = std::exchange(looks, 0);
  expect_refused(far, Reason::NOT_CONNECTED, no_memory_at_last);
  EXPECT_EQ(looks, last);

  way.clear_filter();
  way.set_max_cost(1);
  expect_by_closure(core_);
  EXPECT_TRUE(route(core_, way).summary().no_way_by_edges());
  expect_refused(far, Reason::COST_LIMIT);
}

TEST_F(ImportGraph, AnInvalidPieceIsRefusedByNameAndNothingIsWritten) {
  const auto refused = [&](const v1::ImportGraphRequest& request) {
    const auto reply = import(request);
    EXPECT_TRUE(mapper_->view()->sessions().empty());
    return reply.status();
  };
  auto request = piece(0, 10);
  request.set_session_uuid("short");
  EXPECT_EQ(refused(request).reason(), Reason::INVALID_ARGUMENT);
  request = piece(0, 10);
  request.set_name("");
  EXPECT_EQ(refused(request).reason(), Reason::BAD_NAME);
  request = piece(0, 0);
  request.set_name(std::string(70000, 'x'));
  EXPECT_EQ(refused(request).reason(), Reason::BAD_NAME) << "also without frames";
  request = piece(0, 10);
  request.mutable_frames(3)->mutable_step()->set_upper(0, -1);
  EXPECT_EQ(refused(request).to_string().substr(0, 23), "BAD_COVARIANCE: frame 3");
  request = piece(0, 10);
  request.mutable_frames(3)->set_time_us(5);
  EXPECT_EQ(refused(request).reason(), Reason::BAD_DURATION);
  request = piece(0, 10);
  add_loop(request, 7, 7, SE3());
  EXPECT_EQ(refused(request).to_string(), "INVALID_ARGUMENT: the loop 7 - 7: it leads from a frame to itself");
  request = piece(0, 10);
  add_loop(request, 10, 2, SE3());
  EXPECT_EQ(refused(request).reason(), Reason::NO_SUCH_FRAME);
  EXPECT_EQ(refused(piece(5, 10)).to_string(), "NO_SUCH_FRAME: frames from 0 on are missing");
  request = piece(0, 10);
  add_loop(request, 7, 2, SE3(Matrix3::Identity(), {1e100, 0, 0}));
  EXPECT_EQ(refused(request).reason(), Reason::BAD_MOTION);
  request = piece(0, 1001);
  EXPECT_EQ(refused(request).reason(), Reason::INVALID_ARGUMENT);
}

TEST_F(ImportGraph, PiecesMustFollowEachOtherInTime) {
  ASSERT_TRUE(import(piece(0, 10)).ok());
  auto next = piece(10, 20);
  for (int i = 0; i < 10; ++i) next.mutable_frames(i)->set_time_us(static_cast<std::uint64_t>(i + 1));
  EXPECT_EQ(import(next).reason(), Reason::TIME_BACKWARDS);
  EXPECT_EQ(mapper_->view()->session(1)->frames, 10u);
}

}  // namespace
}  // namespace relmap::rpc
