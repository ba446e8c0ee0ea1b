#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "proto/wire/convert.h"
#include "relmap/v1/evidence.pb.h"
#include "relmap/v1/map.pb.h"
#include "server/rpc/handlers.h"
#include "server/rpc/testing/served_map.h"

namespace relmap::rpc {
namespace {

using testing::HasSubstr;

// Two sessions on one circuit, with closures within each and between them, and one elsewhere.
class EdgeListHandlers : public testing::Test {
 protected:
  EdgeListHandlers() {
    sim::PointsWorldOptions again = ServedMap::circuit_options();
    again.noise_seed = 3;
    again.uuid.bytes[15] = 3;
    again.session = "again";
    map_.take_in(sim::PointsWorld(again));
    map_.settle();
  }

  std::vector<v1::Edge> all(v1::ListEdgesRequest request) {
    std::vector<v1::Edge> edges;
    std::uint64_t version = 0;
    do {
      const auto page = call(*map_.core, list_edges, request, deadline_).or_throw();
      if (version == 0) version = page.map_version();
      EXPECT_EQ(page.map_version(), version);
      edges.insert(edges.end(), page.edges().begin(), page.edges().end());
      request.set_page_token(page.next_page_token());
    } while (!request.page_token().empty());
    return edges;
  }
  Reason refused(const v1::ListEdgesRequest& request) {
    return call(*map_.core, list_edges, request, deadline_).reason();
  }
  static std::vector<EdgeId> ids(const std::vector<v1::Edge>& edges) {
    std::vector<EdgeId> found;
    for (const v1::Edge& edge : edges) found.push_back(from_wire(edge.id()).or_throw());
    return found;
  }
  static v1::ListEdgesRequest loops() {
    v1::ListEdgesRequest request;
    request.add_kinds(v1::EDGE_KIND_LOOP);
    return request;
  }

  ServedMap map_;
  Deadline deadline_;
};

TEST_F(EdgeListHandlers, FiltersChooseAmongAllEdges) {
  const std::vector<v1::Edge> everything = all({});
  const auto expect = [&](const v1::ListEdgesRequest& request, const std::function<bool(const v1::Edge&)>& has) {
    std::vector<v1::Edge> expected;
    std::copy_if(everything.begin(), everything.end(), std::back_inserter(expected), has);
    v1::ListEdgesRequest in_pages = request;
    in_pages.set_page_size(7);
    EXPECT_EQ(ids(all(request)), ids(expected)) << request.ShortDebugString();
    EXPECT_EQ(ids(all(in_pages)), ids(expected)) << request.ShortDebugString();
    return expected.size();
  };
  v1::ListEdgesRequest request = loops();
  EXPECT_GT(expect(request, [](const v1::Edge& e) { return e.kind() == v1::EDGE_KIND_LOOP; }), 5u);
  request.set_session(1);
  request.set_other_session(3);
  EXPECT_GT(
      expect(request, [](const v1::Edge& e) { return e.a().session() + e.b().session() == 4 && e.a().session() == 1; }),
      5u);
  request.clear_kinds();
  request.set_session(2);
  request.set_other_session(2);
  EXPECT_EQ(expect(request, [](const v1::Edge& e) { return e.a().session() == 2 && e.b().session() == 2; }),
            ServedMap::kElsewhere - 1);

  request.Clear();
  const std::int64_t middle = everything[everything.size() / 2].time_us();
  request.set_from_us(middle);
  EXPECT_GT(expect(request, [&](const v1::Edge& e) { return e.time_us() >= middle; }), 10u);
  request.set_until_us(middle + 5'000'000);
  EXPECT_GT(
      expect(request, [&](const v1::Edge& e) { return e.time_us() >= middle && e.time_us() < middle + 5'000'000; }),
      0u);
  request.Clear();
  request.set_min_suspicion(0.05);
  expect(request, [](const v1::Edge& e) { return e.kind() == v1::EDGE_KIND_LOOP && e.suspicion().value() >= 0.05; });

  request.Clear();
  *request.mutable_region()->mutable_root() = to_wire(FrameId{1, 20});
  request.mutable_region()->set_max_edges(3);
  v1::GetNeighbourhoodRequest around;
  *around.mutable_root() = request.region().root();
  around.set_max_edges(3);
  std::set<FrameId> near;
  const auto neighbourhood = call(*map_.core, get_neighbourhood, around, deadline_).or_throw();
  for (const v1::NeighbourhoodFrame& frame : neighbourhood.frames()) near.insert(from_wire(frame.frame()).or_throw());
  const auto is_near = [&](const v1::Edge& e) {
    return near.contains(from_wire(e.a()).or_throw()) || near.contains(from_wire(e.b()).or_throw());
  };
  EXPECT_GT(expect(request, is_near), 6u);
  request.add_kinds(v1::EDGE_KIND_LOOP);
  request.set_session(3);
  expect(request, [&](const v1::Edge& e) {
    return is_near(e) && e.kind() == v1::EDGE_KIND_LOOP && (e.a().session() == 3 || e.b().session() == 3);
  });
}

TEST_F(EdgeListHandlers, ClosuresAreListedInOrder) {
  const std::size_t count = all(loops()).size();
  for (const auto order : {v1::EDGE_ORDER_SUSPICION, v1::EDGE_ORDER_TIME}) {
    v1::ListEdgesRequest request;
    request.set_order(order);
    const auto whole = all(request);
    ASSERT_EQ(whole.size(), count);
    for (std::size_t i = 1; i < whole.size(); ++i) {
      if (order == v1::EDGE_ORDER_SUSPICION) {
        EXPECT_GE(whole[i - 1].suspicion().value(), whole[i].suspicion().value());
      } else {
        EXPECT_GE(whole[i - 1].time_us(), whole[i].time_us());
      }
    }
    for (const std::uint32_t size : {1, 3}) {
      request.set_page_size(size);
      EXPECT_EQ(ids(all(request)), ids(whole));
    }
    // A token is of one order.
    const std::string token = call(*map_.core, list_edges, request, deadline_)->next_page_token();
    request.set_page_token(token);
    request.set_order(order == v1::EDGE_ORDER_TIME ? v1::EDGE_ORDER_SUSPICION : v1::EDGE_ORDER_TIME);
    EXPECT_EQ(refused(request), Reason::INVALID_ARGUMENT);
    request.set_order(v1::EDGE_ORDER_ID);
    EXPECT_EQ(refused(request), Reason::INVALID_ARGUMENT);
    request.set_order(order);
    for (const char* wrong : {"s", "t,", "s1", "s1,1:2", "sx,1:2/3", "s9221120237041090561,1:2/1" /* no number */}) {
      request.set_page_token(token.substr(0, token.rfind('-') + 1) + wrong);
      EXPECT_EQ(refused(request), Reason::INVALID_ARGUMENT) << wrong;
    }
  }
  v1::ListEdgesRequest motion;
  motion.set_order(v1::EDGE_ORDER_TIME);
  motion.add_kinds(v1::EDGE_KIND_ODOMETRY);
  EXPECT_TRUE(all(motion).empty()) << "only closures are ordered";
}

TEST_F(EdgeListHandlers, AListShowsAnEditAtOnce) {
  v1::ListEdgesRequest request;
  request.set_order(v1::EDGE_ORDER_SUSPICION);
  request.add_states(v1::EDGE_STATE_ACCEPTED);
  const auto before = all(request);
  ASSERT_FALSE(before.empty());
  v1::SetEdgeStateRequest edit;
  *edit.mutable_edge() = before.back().id();
  edit.set_state(v1::EDGE_STATE_REMOVED);
  edit.set_alone(true);
  ASSERT_TRUE(call(*map_.core, set_edge_state, edit, deadline_).ok());
  std::vector<EdgeId> left = ids(before), now = ids(all(request));
  std::erase(left, from_wire(edit.edge()).or_throw());
  std::sort(left.begin(), left.end());
  std::sort(now.begin(), now.end());
  EXPECT_EQ(now, left);
  request.clear_states();
  request.add_states(v1::EDGE_STATE_REMOVED);
  ASSERT_EQ(all(request).size(), 1u);
  EXPECT_EQ(all(request)[0].state(), v1::EDGE_STATE_REMOVED);
}

TEST_F(EdgeListHandlers, TheMatrixHasTheCountsOfTheLists) {
  v1::GetClosureMatrixRequest request;
  const auto cells = [&](v1::GetClosureMatrixRequest asked) {
    std::vector<v1::ClosureMatrixCell> found;
    do {
      const auto page = call(*map_.core, get_closure_matrix, asked, deadline_).or_throw();
      EXPECT_GT(page.map_version(), 0u);
      found.insert(found.end(), page.cells().begin(), page.cells().end());
      asked.set_page_token(page.next_page_token());
    } while (!asked.page_token().empty());
    return found;
  };
  const auto whole = cells(request);
  ASSERT_GE(whole.size(), 2u);
  std::size_t listed = 0;
  for (const v1::ClosureMatrixCell& cell : whole) {
    ASSERT_LE(cell.session_a(), cell.session_b());
    v1::ListEdgesRequest edges = loops();
    edges.set_session(cell.session_a());
    edges.set_other_session(cell.session_b());
    edges.set_order(v1::EDGE_ORDER_SUSPICION);
    std::map<v1::EdgeState, std::uint32_t> counts;
    const v1::Edge* most = nullptr;
    const auto between = all(edges);
    for (const v1::Edge& edge : between) {
      ++counts[edge.state()];
      if (!most && edge.state() == v1::EDGE_STATE_ACCEPTED) most = &edge;
    }
    listed += between.size();
    EXPECT_EQ(cell.candidate(), counts[v1::EDGE_STATE_CANDIDATE]);
    EXPECT_EQ(cell.accepted(), counts[v1::EDGE_STATE_ACCEPTED]);
    EXPECT_EQ(cell.quarantined(), counts[v1::EDGE_STATE_QUARANTINED]);
    EXPECT_EQ(cell.removed(), counts[v1::EDGE_STATE_REMOVED]);
    ASSERT_EQ(cell.has_most_suspicious(), most != nullptr);
    if (!most) continue;
    EXPECT_EQ(cell.most_suspicious().SerializeAsString(), most->id().SerializeAsString());
    EXPECT_EQ(cell.suspicion(), most->suspicion().value());
  }
  EXPECT_EQ(listed, all(loops()).size());
  const auto text = [](const std::vector<v1::ClosureMatrixCell>& of) {
    std::string joined;
    for (const v1::ClosureMatrixCell& cell : of) joined += cell.ShortDebugString() + "\n";
    return joined;
  };
  request.set_page_size(1);
  EXPECT_EQ(text(cells(request)), text(whole));
  request.add_sessions(3);
  for (const v1::ClosureMatrixCell& cell : cells(request)) EXPECT_EQ(cell.session_b(), 3u);
  request.add_sessions(9);
  EXPECT_EQ(call(*map_.core, get_closure_matrix, request, deadline_).reason(), Reason::NO_SUCH_SESSION);
  request.Clear();
  request.set_page_size(1);
  const std::string token = call(*map_.core, get_closure_matrix, request, deadline_)->next_page_token();
  for (const char* wrong : {"1", "1,", "x,1", "1,2,3"}) {
    request.set_page_token(token.substr(0, token.rfind('-') + 1) + wrong);
    EXPECT_EQ(call(*map_.core, get_closure_matrix, request, deadline_).reason(), Reason::INVALID_ARGUMENT) << wrong;
  }
  EXPECT_EQ(map_.mapper->budget().used(storage::Share::kReplies), 0u);
}

TEST_F(EdgeListHandlers, RequestsAreChecked) {
  const auto with = [this](const std::function<void(v1::ListEdgesRequest&)>& set) {
    v1::ListEdgesRequest request;
    set(request);
    return refused(request);
  };
  using R = v1::ListEdgesRequest;
  EXPECT_EQ(with([](R& r) { r.set_other_session(1); }), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(with([](R& r) { r.set_session(1), r.set_other_session(9); }), Reason::NO_SUCH_SESSION);
  EXPECT_EQ(with([](R& r) { r.set_from_us(-1); }), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(with([](R& r) { r.set_from_us(7), r.set_until_us(7); }), Reason::INVALID_ARGUMENT);
  for (const double wrong : {-0.1, 1.1, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_EQ(with([&](R& r) { r.set_min_suspicion(wrong); }), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(with([](R& r) { r.set_order(static_cast<v1::EdgeOrder>(7)); }), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(with([](R& r) { r.mutable_region(); }), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(with([](R& r) { *r.mutable_region()->mutable_root() = to_wire(FrameId{1, 4711}); }), Reason::NO_SUCH_FRAME);
  EXPECT_EQ(with([](R& r) {
              *r.mutable_region()->mutable_root() = to_wire(FrameId{1, 1});
              r.mutable_region()->set_max_metres(-1);
            }),
            Reason::INVALID_ARGUMENT);
  Core narrow(*map_.mapper, map_.core->facts, {.max_search_frames = 20});
  v1::ListEdgesRequest wide;
  *wide.mutable_region()->mutable_root() = to_wire(FrameId{1, 10});
  wide.mutable_region()->set_max_edges(1000);
  const auto too_wide = call(narrow, list_edges, wide, deadline_);
  EXPECT_EQ(too_wide.reason(), Reason::INVALID_ARGUMENT);
  EXPECT_THAT(too_wide.status().message(), HasSubstr("20 frames"));
  Deadline late;
  late.at = std::chrono::steady_clock::now();
  v1::ListEdgesRequest ordered;
  ordered.set_order(v1::EDGE_ORDER_TIME);
  EXPECT_EQ(call(*map_.core, list_edges, ordered, late).reason(), Reason::DEADLINE);
}

}  // namespace
}  // namespace relmap::rpc
