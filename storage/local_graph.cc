#include "storage/local_graph.h"

#include <algorithm>

#include "storage/path_tree.h"

namespace relmap {

void LocalGraph::clear() {
  index_.clear();
  last_ = {{}, -1};
  frames.clear();
  edges.clear();
  edge_at_.clear();
  steps_.clear();
  visited_.clear();
  wanted_.clear();
  visit_ = 0;
}

std::int32_t LocalGraph::frame(FrameId id) {
  if (id == last_.first) return last_.second;  // observations come base by base
  if (const std::int32_t* known = index_.find(id)) {
    last_ = {id, *known};
    return *known;
  }
  auto hot = graph_.hot(id);
  std::int32_t index = -1;
  if (hot != nullptr && hot->present) {
    index = static_cast<std::int32_t>(frames.size());
    const auto first_edge = static_cast<std::int32_t>(edge_at_.size());
    edge_at_.resize(edge_at_.size() + hot->edges.size(), -1);
    visited_.push_back(0);
    wanted_.push_back(0);
    frames.push_back({id, std::move(hot), first_edge, -1, -1});
  }
  index_.insert(id, index);
  return index;
}

std::int32_t LocalGraph::edge(std::int32_t owner, std::size_t position) {
  const std::size_t at = static_cast<std::size_t>(frames[owner].first_edge) + position;
  if (edge_at_[at] >= 0) return edge_at_[at];
  const Edge& record = frames[owner].hot->edges[position];
  const std::int32_t a = frame(record.a);
  edge_at_[at] = static_cast<std::int32_t>(edges.size());
  edges.push_back({record.id, a, owner, &record});
  return edge_at_[at];
}

std::span<const LocalStep> LocalGraph::steps(std::int32_t of) {
  if (frames[of].first_step < 0) {
    const FrameHot& hot = *frames[of].hot;
    const auto first = static_cast<std::int32_t>(steps_.size());
    for (std::size_t k = 0; k < hot.edges.size(); ++k) {
      if (!hot.edges[k].in_graph()) continue;
      const std::int32_t e = edge(of, k);
      if (edges[e].a >= 0) steps_.push_back({e, edges[e].a, false});
    }
    for (const EdgeId incoming : hot.incoming) {
      const std::int32_t other = frame(incoming.frame);
      if (other < 0) continue;
      const FrameHot& newer = *frames[other].hot;
      for (std::size_t k = 0; k < newer.edges.size(); ++k)
        if (newer.edges[k].id == incoming && newer.edges[k].in_graph()) steps_.push_back({edge(other, k), other, true});
    }
    std::sort(steps_.begin() + first, steps_.end(),
              [&](const LocalStep& l, const LocalStep& r) { return edges[l.edge].id < edges[r.edge].id; });
    frames[of].first_step = first;
    frames[of].end_step = static_cast<std::int32_t>(steps_.size());
  }
  return {steps_.data() + frames[of].first_step, steps_.data() + frames[of].end_step};
}

void LocalGraph::nearest(std::int32_t root, std::uint32_t count, std::vector<std::int32_t>* found) {
  ++visit_;
  visited_[root] = visit_;
  const std::size_t first = found->size(), end = first + count;
  found->push_back(root);
  for (std::size_t next = first; next < found->size() && found->size() < end; ++next)
    for (const LocalStep step : steps((*found)[next])) {
      if (visited_[step.frame] == visit_ || found->size() >= end) continue;
      visited_[step.frame] = visit_;
      found->push_back(step.frame);
    }
}

void LocalGraph::path_tree(std::int32_t root, std::span<const std::int32_t> targets, std::vector<TreeNode>* nodes) {
  ++visit_;
  std::size_t missing = 0;
  for (const std::int32_t target : targets) {
    if (target == root || wanted_[target] == visit_) continue;
    wanted_[target] = visit_;
    ++missing;
  }
  search_.clear();
  search_.push_back({root, -1, -1, false, 0});
  visited_[root] = visit_;
  bool cut = false;
  for (std::size_t next = 0; next < search_.size() && missing > 0 && !cut; ++next) {
    const TreeNode node = search_[next];
    for (const LocalStep step : steps(node.frame)) {
      if (visited_[step.frame] == visit_) continue;
      if (node.depth == kPathDepth || search_.size() == kPathFrames) {
        cut = true;
        break;
      }
      visited_[step.frame] = visit_;
      search_.push_back({step.frame, static_cast<std::int32_t>(next), step.edge, step.forward, node.depth + 1});
      if (wanted_[step.frame] == visit_ && --missing == 0) break;
    }
  }
  // Cut to what leads to a target: from the back, so that a needed child marks its parent before that is looked at.
  renumbered_.assign(search_.size(), -1);
  renumbered_[0] = 0;
  for (std::size_t n = search_.size(); n-- > 1;)
    if (renumbered_[n] == 0 || wanted_[search_[n].frame] == visit_) {
      renumbered_[n] = 0;
      renumbered_[search_[n].parent] = 0;
    }
  std::int32_t kept = 0;
  for (std::size_t n = 0; n < search_.size(); ++n) {
    if (renumbered_[n] < 0) continue;
    renumbered_[n] = kept++;
    nodes->push_back(search_[n]);
    if (n > 0) nodes->back().parent = renumbered_[search_[n].parent];
  }
}

}  // namespace relmap
