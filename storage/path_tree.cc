#include "storage/path_tree.h"

namespace relmap {

PathSearch::PathSearch(const Graph& graph, FrameId root, PathLimits limits) : graph_(graph), limits_(limits) {
  if (limits.frames == 0 || !graph.hot(root)) return;
  tree_.nodes.push_back({root, -1, {}, false, 0});
  tree_.index.emplace(root, 0);
}

const PathNode* PathSearch::find(FrameId frame) {
  if (const PathNode* node = tree_.find(frame)) return node;
  while (!tree_.cut) {
    if (step_ == steps_.size()) {
      if (next_ == tree_.nodes.size()) break;
      const FrameId id = tree_.nodes[next_++].frame;
      const auto hot = graph_.hot(id);
      steps_ = hot ? neighbours(graph_, id, *hot) : std::vector<Neighbour>{};
      step_ = 0;
      continue;
    }
    const Neighbour& step = steps_[step_++];
    if (tree_.index.contains(step.frame)) continue;
    const std::uint32_t depth = tree_.nodes[next_ - 1].depth;
    if (depth == limits_.depth || tree_.nodes.size() == limits_.frames) {
      tree_.cut = true;  // and so is all that follows: later nodes are as deep, or the tree is full
      break;
    }
    tree_.index.emplace(step.frame, static_cast<std::uint32_t>(tree_.nodes.size()));
    tree_.nodes.push_back({step.frame, static_cast<std::int32_t>(next_ - 1), step.edge, step.forward, depth + 1});
    if (step.frame == frame) return &tree_.nodes.back();
  }
  return nullptr;
}

PathTree build_path_tree(const Graph& graph, FrameId root, PathLimits limits) {
  PathSearch search(graph, root, limits);
  search.find(limits.until);
  return std::move(search).take();
}

std::vector<SE3> poses_along(const Graph& graph, const PathTree& tree) {
  std::vector<SE3> poses(tree.nodes.size());
  for (std::size_t i = 1; i < tree.nodes.size(); ++i) {
    const PathNode& node = tree.nodes[i];
    const auto hot = graph.hot(node.edge.frame);
    const Edge* edge = hot ? hot->edge(node.edge) : nullptr;
    if (!edge)
      throw StatusError(Status(Reason::NO_SUCH_EDGE, node.edge.to_string() + " left the graph under its tree"));
    poses[i] = poses[static_cast<std::size_t>(node.parent)] * (node.forward ? edge->T_ab : edge->T_ab.inverse());
  }
  return poses;
}

}  // namespace relmap
