#include "server/place/older_views.h"

#include <algorithm>

#include "storage/local_graph.h"

namespace relmap {

namespace {

// Frames of one session so near to each other in it that the walk up found both from one.
bool same_pass(FrameId a, FrameId b) {
  const std::uint32_t steps = a.index > b.index ? a.index - b.index : b.index - a.index;
  return a.session == b.session && steps <= kPathDepth;
}

}  // namespace

std::vector<FrameId> older_views(const Graph& graph, FrameId match, const SE3& T_match_query) {
  LocalGraph local(graph);
  const std::int32_t root = local.frame(match);
  if (root < 0) return {};
  std::vector<std::int32_t> walk, ends;
  local.nearest(root, kWalkFrames, &walk);
  std::vector<LocalGraph::TreeNode> nodes;
  local.path_tree(root, walk, &nodes, &ends);

  std::vector<SE3> T_node_match(nodes.size());
  struct View {
    std::uint64_t taken_in = 0;
    double distance = 0;
    FrameId frame;
  };
  std::vector<View> views;
  for (std::size_t n = 1; n < nodes.size(); ++n) {
    const SE3& T_parent_match = T_node_match[static_cast<std::size_t>(nodes[n].parent)];
    const SE3& T_ab = local.edges[static_cast<std::size_t>(nodes[n].edge)].record->T_ab;
    T_node_match[n] = nodes[n].forward ? T_ab.inverse() * T_parent_match : T_ab * T_parent_match;
    const SE3 T_node_query = T_node_match[n] * T_match_query;
    if (T_node_query.t.norm() > kMaxViewDistance || rotation_angle(T_node_query.R) > kMaxViewAngle) continue;
    const LocalFrame& frame = local.frames[static_cast<std::size_t>(nodes[n].frame)];
    if (!same_pass(frame.id, match)) views.push_back({frame.hot->journal_sequence, T_node_query.t.norm(), frame.id});
  }
  std::sort(views.begin(), views.end(), [](const View& l, const View& r) { return l.taken_in < r.taken_in; });

  std::vector<FrameId> nearest;
  for (std::size_t begin = 0, end = 0; begin < views.size() && nearest.size() < kMostOlderViews; begin = end) {
    while (end < views.size() && same_pass(views[end].frame, views[begin].frame)) ++end;
    nearest.push_back(std::min_element(views.begin() + static_cast<std::ptrdiff_t>(begin),
                                       views.begin() + static_cast<std::ptrdiff_t>(end),
                                       [](const View& l, const View& r) { return l.distance < r.distance; })
                          ->frame);
  }
  return nearest;
}

}  // namespace relmap
