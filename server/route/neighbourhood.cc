#include "server/route/neighbourhood.h"

#include <algorithm>

#include "server/route/breadth_first.h"
#include "server/route/edge_access.h"
#include "server/route/weight.h"
#include "storage/graph/frame.h"

namespace relmap::route {

Result<Neighbourhood> neighbourhood(const storage::Graph& graph, FrameId root, const NeighbourhoodLimits& limits,
                                    const WorkLimit& work) {
  Neighbourhood result;
  result.frames.push_back({.frame = root, .T_root_frame = {}});
  const auto tree = search_breadth_first(
      graph, root, work, [&](const storage::PathTree&, const storage::PathNode& node, const storage::Edge& edge) {
        if (node.depth > limits.edges) return Visit::kDrop;
        const NeighbourhoodFrame& parent = result.frames[static_cast<std::size_t>(node.parent)];
        const double distance = parent.distance_m + length_m(edge);
        if (distance > limits.metres) return Visit::kDrop;
        result.frames.push_back({node.frame, parent.T_root_frame * walked(edge, node.forward), node.depth, distance,
                                 parent.unmeasured_steps + storage::is_unmeasured(edge)});
        return node.depth == limits.edges ? Visit::kLeaf : Visit::kExpand;
      });
  if (!tree.ok()) return tree.status();
  result.cut = tree->cut;

  // Each edge is listed once, by the frame that stores it.
  for (const NeighbourhoodFrame& member : result.frames) {
    const auto hot = graph.hot(member.frame);
    if (!hot) continue;
    for (const storage::Edge& edge : hot->edges)
      if (edge.in_graph() && tree->index.contains(edge.a)) result.edges.push_back(edge.id);
  }
  std::sort(result.edges.begin(), result.edges.end());
  return result;
}

}  // namespace relmap::route
