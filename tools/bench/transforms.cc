#include "tools/bench/transforms.h"

#include <memory>
#include <unordered_map>

#include "client/relaxation.h"
#include "storage/graph/path_tree.h"

namespace relmap::bench {

Transform relative_map(const storage::Graph& graph) {
  return [&graph](FrameId from, FrameId to) -> std::optional<SE3> {
    const storage::PathTree tree = storage::build_path_tree(graph, from, {.until = to});
    const storage::PathNode* node = tree.find(to);
    if (!node) return std::nullopt;
    return storage::poses_along(graph, tree)[static_cast<std::size_t>(node - tree.nodes.data())];
  };
}

Transform pose_graph(const storage::Graph& graph, const std::vector<FrameId>& frames, double loop_huber) {
  std::vector<client::RelaxationEdge> edges;
  for (const FrameId frame : frames) {
    const auto hot = graph.hot(frame);
    for (const storage::Edge& edge : hot->edges) {
      if (edge.state != storage::EdgeState::kAccepted) continue;
      const bool loop = edge.kind == storage::EdgeKind::kLoop;
      edges.push_back({edge.a, edge.b, loop ? edge.prior_T_ab : edge.T_ab,
                       loop ? edge.prior_covariance : edge.covariance,
                       loop ? client::RelaxationEdgeKind::kLoop : client::RelaxationEdgeKind::kOdometry});
    }
  }
  client::RelaxationOptions how;
  how.loop_huber = loop_huber;
  how.max_iterations = 200;
  const auto poses = std::make_shared<std::unordered_map<FrameId, SE3>>();
  for (const client::RelaxedPose& pose : client::relax(frames, edges, how).or_throw().poses)
    (*poses)[pose.frame] = pose.T_component_frame;
  return [poses](FrameId from, FrameId to) -> std::optional<SE3> { return poses->at(from).inverse() * poses->at(to); };
}

}  // namespace relmap::bench
