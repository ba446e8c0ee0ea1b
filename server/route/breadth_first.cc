#include "server/route/breadth_first.h"

#include "server/route/edge_access.h"

namespace relmap::route {

namespace {
// Memory of a node of the tree, at most: the node, its hash entry, and unused capacity.
constexpr std::size_t kBytesPerNode = 192;
}  // namespace

Result<storage::PathTree> search_breadth_first(const storage::Graph& graph, FrameId root, const WorkLimit& work,
                                               const Visitor& visit) {
  if (!graph.hot(root)) return {Reason::NO_SUCH_FRAME, "no frame " + root.to_string()};
  storage::PathTree tree;
  std::vector<bool> leaf{false};
  tree.nodes.push_back({root, -1, {}, false, 0});
  tree.index.emplace(root, 0);
  for (std::size_t next = 0; next < tree.nodes.size(); ++next) {
    if (next % kWorkStride == 0 && work.proceed)
      if (Status status = work.proceed(tree.nodes.size() * kBytesPerNode); !status.ok()) return status;
    if (leaf[next]) continue;
    const FrameId frame = tree.nodes[next].frame;
    const auto hot = graph.hot(frame);
    if (!hot) continue;
    for (const storage::Neighbour& step : storage::neighbours(graph, frame, *hot)) {
      if (tree.index.contains(step.frame)) continue;
      if (tree.nodes.size() >= work.max_frames) {
        tree.cut = true;
        return tree;
      }
      const storage::PathNode node{step.frame, static_cast<std::int32_t>(next), step.edge, step.forward,
                                   tree.nodes[next].depth + 1};
      const EdgeRef edge(graph, frame, hot, step);
      const Visit wish = visit(tree, node, *edge);
      if (wish == Visit::kDrop) continue;
      tree.index.emplace(step.frame, static_cast<std::uint32_t>(tree.nodes.size()));
      tree.nodes.push_back(node);
      leaf.push_back(wish == Visit::kLeaf);
      if (wish == Visit::kStop) return tree;
    }
  }
  return tree;
}

}  // namespace relmap::route
