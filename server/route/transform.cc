#include "server/route/transform.h"

#include <algorithm>

#include "server/route/breadth_first.h"
#include "server/route/edge_access.h"
#include "server/route/weight.h"

namespace relmap {

namespace {

Transform compound(const Graph& graph, const PathTree& tree, std::uint32_t goal) {
  std::vector<std::uint32_t> chain;
  for (std::uint32_t i = goal; tree.nodes[i].parent >= 0; i = static_cast<std::uint32_t>(tree.nodes[i].parent))
    chain.push_back(i);
  std::reverse(chain.begin(), chain.end());

  Transform result;
  for (const std::uint32_t i : chain) {
    const PathNode& node = tree.nodes[i];
    const EdgeRef edge(graph.hot(node.edge.frame), node.edge);
    const SE3 step = walked(*edge, node.forward);
    result.covariance = compound_covariance(result.covariance, step, walked_covariance(*edge, node.forward));
    result.T_ab = result.T_ab * step;
    result.distance_m += length_m(*edge);
    ++result.edges;
  }
  result.T_ab = result.T_ab.normalized();
  result.covariance = 0.5 * (result.covariance + result.covariance.transpose()).eval();
  return result;
}

}  // namespace

Result<Transform> transform_between(const Graph& graph, FrameId a, FrameId b, const WorkLimit& work) {
  if (!graph.hot(b)) return {Reason::NO_SUCH_FRAME, "no frame " + b.to_string()};
  const auto tree = search_breadth_first(graph, a, work, [&](const PathTree&, const PathNode& node, const Edge&) {
    return node.frame == b ? Visit::kStop : Visit::kExpand;
  });
  if (!tree.ok()) return tree.status();
  const auto found = tree->index.find(b);
  if (found != tree->index.end()) return compound(graph, *tree, found->second);
  if (tree->cut)
    return {Reason::OUT_OF_REACH, b.to_string() + " was not found among the " + std::to_string(tree->nodes.size()) +
                                      " frames nearest to " + a.to_string()};
  return {Reason::NOT_CONNECTED, "no chain of accepted edges from " + a.to_string() + " to " + b.to_string()};
}

}  // namespace relmap
