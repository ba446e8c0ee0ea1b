#include "storage/graph/path_tree.h"

namespace relmap::storage {

PathTree build_path_tree(const Graph& graph, FrameId root, PathLimits limits) {
  PathTree tree;
  if (limits.frames == 0 || !graph.hot(root)) return tree;
  tree.nodes.push_back({root, -1, {}, false, 0});
  tree.index.emplace(root, 0);
  if (root == limits.until) return tree;
  for (std::size_t next = 0; next < tree.nodes.size(); ++next) {
    const FrameId id = tree.nodes[next].frame;
    const std::uint32_t depth = tree.nodes[next].depth;
    const auto hot = graph.hot(id);
    if (!hot) continue;
    for (const Neighbour& step : neighbours(graph, id, *hot)) {
      if (tree.index.contains(step.frame)) continue;
      if (depth == limits.depth || tree.nodes.size() == limits.frames) {
        tree.cut = true;  // nothing can follow: later nodes are as deep, or the tree is full
        return tree;
      }
      tree.index.emplace(step.frame, static_cast<std::uint32_t>(tree.nodes.size()));
      tree.nodes.push_back({step.frame, static_cast<std::int32_t>(next), step.edge, step.forward, depth + 1});
      if (step.frame == limits.until) return tree;
    }
  }
  return tree;
}

std::vector<SE3> poses_along(const Graph& graph, const PathTree& tree) {
  std::vector<SE3> poses(tree.nodes.size());
  for (std::size_t i = 1; i < tree.nodes.size(); ++i) {
    const PathNode& node = tree.nodes[i];
    const auto hot = graph.hot(node.edge.frame);
    const Edge* edge = hot ? hot->edge(node.edge) : nullptr;
    if (!edge)
      throw StatusError(
          Status(Reason::NO_SUCH_EDGE, node.edge.to_string() + " was removed from the graph while a tree held it"));
    poses[i] = poses[static_cast<std::size_t>(node.parent)] * (node.forward ? edge->T_ab : edge->T_ab.inverse());
  }
  return poses;
}

}  // namespace relmap::storage
