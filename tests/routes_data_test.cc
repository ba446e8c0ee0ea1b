// Routes through recorded pose graphs with all loops as edges: cells find the same costs as Dijkstra.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "server/route/dijkstra.h"
#include "server/route/overlay/overlay_search.h"
#include "storage/testing/partial_graph.h"
#include "tests/support/data_test.h"
#include "tools/g2o/pose_graph.h"

namespace relmap::testing {
namespace {

// One session, as the file has it.
class RecordedGraph final : public storage::PartialGraph {
 public:
  explicit RecordedGraph(const g2o::PoseGraph& recorded) {
    for (std::size_t i = 0; i < recorded.ids.size(); ++i) {
      frames_.push_back(std::make_shared<storage::FrameHot>());
      frames_.back()->present = true;
    }
    for (const g2o::PoseGraph::Edge& step : recorded.odometry)
      add(step.b, step.a, step.T_ab, step.covariance, storage::EdgeKind::kOdometry);
    for (const g2o::PoseGraph::Edge& loop : recorded.loops)
      add(loop.a, loop.b, loop.T_ab.inverse(), loop.covariance, storage::EdgeKind::kLoop);
    for (const auto& frame : frames_) std::sort(frame->incoming.begin(), frame->incoming.end());
  }
  std::uint32_t size() const { return static_cast<std::uint32_t>(frames_.size()); }

  std::shared_ptr<const storage::FrameHot> hot(FrameId id) const override {
    return id.session == 1 && id.index < size() ? frames_[id.index] : nullptr;
  }
  std::vector<storage::Session> all_sessions() const override { return {*session(1)}; }
  std::optional<storage::Session> session(SessionNumber) const override {
    storage::Session session;
    session.number = 1;
    session.display_name = "recorded";
    session.frames = size();
    session.last = size() - 1;
    return session;
  }

 private:
  // From the newer frame's side.
  void add(std::uint32_t newer, std::uint32_t older, const SE3& T_older_newer, const Matrix6& covariance,
           storage::EdgeKind kind) {
    storage::FrameHot& frame = *frames_[newer];
    storage::Edge edge;
    edge.id = {{1, newer}, kind == storage::EdgeKind::kOdometry ? 0u : frame.next_loop_ordinal++};
    edge.a = {1, older};
    edge.b = {1, newer};
    edge.kind = kind;
    edge.T_ab = T_older_newer;
    edge.covariance = covariance;
    edge.driven_s = static_cast<float>(0.1 + 0.01 * (newer % 7));
    edge.standing_s = newer % 50 == 0 ? 3.0f : 0.0f;
    frame.edges.push_back(edge);
    frames_[older]->incoming.push_back(edge.id);
  }
  std::vector<std::shared_ptr<storage::FrameHot>> frames_;
};

class RoutesData : public DataTest, public ::testing::WithParamInterface<const char*> {};

TEST_P(RoutesData, CellsFindWhatDijkstraFinds) {
  const RecordedGraph graph(g2o::read_pose_graph(data_ + "/posegraphs/" + GetParam()).or_throw());
  route::Overlay overlay(
      {route::kByDistance, route::kByTime, route::kByTimeStandingToo, route::kByCertainty, {1, 0.5, 0.1, 10}},
      route::CellStore::open_temporary().or_throw());
  overlay.build(graph);
  std::mt19937 random(1);
  int connected = 0;
  for (int query = 0; query < 150; ++query) {
    const std::size_t metric = random() % overlay.metrics().size();
    const std::vector<FrameId> from{{1, static_cast<std::uint32_t>(random() % graph.size())}},
        to{{1, static_cast<std::uint32_t>(random() % graph.size())}};
    const auto expected = route::find_route(graph, from, to, route::RouteOptions{.weights = overlay.metrics()[metric]});
    route::OverlayQuery asked;
    asked.metric = metric;
    const auto found = route::find_route(overlay, graph, asked, from, to);
    ASSERT_EQ(found.ok(), expected.ok()) << from[0].to_string() << " to " << to[0].to_string();
    if (!found.ok()) continue;
    ++connected;
    EXPECT_NEAR(found->cost, expected->cost, 1e-9 * expected->cost);
  }
  EXPECT_GT(connected, 100);
}

INSTANTIATE_TEST_SUITE_P(Graphs, RoutesData,
                         ::testing::Values("NewCollege_odometry_bow_tr.g2o", "Bovisa04_odometry_bow_tr.g2o",
                                           "kitti_00.g2o", "kitti_05.g2o", "sphere2500.g2o"),
                         [](const auto& graph) {
                           std::string name = graph.param;
                           name.resize(name.find('.'));
                           std::erase(name, '_');
                           return name;
                         });

}  // namespace
}  // namespace relmap::testing
