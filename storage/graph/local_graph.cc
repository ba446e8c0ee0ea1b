#include "storage/graph/local_graph.h"

#include <algorithm>

namespace relmap::storage {

void LocalGraph::clear() {
  index_.clear();
  last_ = {{}, -1};
  frames.clear();
  edges.clear();
  edge_at_.clear();
  steps_.clear();
  walks_used_ = 0;
  walk_of_.clear();
  visited_.clear();
  visit_ = 0;
  marked_ = -1;
  node_of_.clear();
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
    walk_of_.push_back(-1);
    node_of_.push_back(-1);
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
    if (const auto next = next_in_session(frames[of].id, hot)) {
      const std::int32_t newer = frame(*next);
      const Edge* motion = newer < 0 ? nullptr : frames[newer].hot->edge({*next, 0});
      if (motion && motion->in_graph() && motion->a == frames[of].id)
        steps_.push_back(
            {edge(newer, static_cast<std::size_t>(motion - frames[newer].hot->edges.data())), newer, true});
    }
    frames[of].first_step = first;
    frames[of].end_step = static_cast<std::int32_t>(steps_.size());
  }
  return {steps_.data() + frames[of].first_step, steps_.data() + frames[of].end_step};
}

void LocalGraph::extend(std::int32_t root, Walk& walk) {
  if (walk.grown < 0) {
    walk.nodes.assign(1, {root, -1, -1, false, true, 0});
    walk.first_loop = Walk::kNoLoop;
    walk.level[0] = 0;
    walk.level[1] = 1;
    walk.grown = 0;
    return;
  }
  ++visit_;
  for (const WalkNode& node : walk.nodes) visited_[node.frame] = visit_;
  for (std::int32_t n = walk.level[walk.grown]; n < walk.level[walk.grown + 1]; ++n)
    for (const LocalStep step : steps(walk.nodes[n].frame)) {
      if (visited_[step.frame] == visit_ || walk.nodes.size() == kWalkFrames) continue;
      visited_[step.frame] = visit_;
      const bool by_motion = walk.nodes[n].by_motion && edges[step.edge].id.ordinal == 0;
      if (!by_motion) walk.first_loop = std::min(walk.first_loop, walk.grown + 1);
      walk.nodes.push_back({step.frame, n, step.edge, step.forward, by_motion, walk.grown + 1});
    }
  ++walk.grown;
  walk.level[walk.grown + 1] = static_cast<std::int32_t>(walk.nodes.size());
}

const LocalGraph::Walk& LocalGraph::walk(std::int32_t of, std::int32_t depth) {
  if (walk_of_[of] < 0) {
    walk_of_[of] = static_cast<std::int32_t>(walks_used_);
    if (walks_used_ == walks_.size()) walks_.emplace_back();
    walks_[walks_used_++].grown = -1;
  }
  Walk& walk = walks_[walk_of_[of]];
  while (walk.grown < depth) extend(of, walk);
  return walk;
}

void LocalGraph::nearest(std::int32_t root, std::uint32_t count, std::vector<std::int32_t>* found) {
  std::int32_t depth = 0;
  while (depth < static_cast<std::int32_t>(kWalkDepth) && walk(root, depth).nodes.size() < count) ++depth;
  const Walk& nodes = walk(root, depth);
  for (std::size_t n = 0; n < std::min<std::size_t>(count, nodes.nodes.size()); ++n)
    found->push_back(nodes.nodes[n].frame);
}

std::vector<SE3> LocalGraph::poses_up(std::int32_t of) {
  const std::vector<WalkNode>& nodes = walk_up(of);
  std::vector<SE3> poses(nodes.size());
  for (std::size_t n = 1; n < nodes.size(); ++n) {
    const SE3& T_ab = edges[nodes[n].edge].record->T_ab;
    poses[n] = poses[nodes[n].parent] * (nodes[n].forward ? T_ab : T_ab.inverse());
  }
  return poses;
}

void LocalGraph::mark(std::int32_t base) {
  if (marked_ == base) return;
  if (marked_ >= 0)
    for (const WalkNode& node : walks_[walk_of_[marked_]].nodes) node_of_[node.frame] = -1;
  marked_ = base;
  marked_nodes_ = 0;
}

bool LocalGraph::mark_more() {
  const Walk* known = &walk(marked_, 0);
  if (marked_nodes_ == known->nodes.size()) {
    if (known->grown == static_cast<std::int32_t>(kWalkDepth)) return false;
    known = &walk(marked_, known->grown + 1);
  }
  for (; marked_nodes_ < known->nodes.size(); ++marked_nodes_)
    node_of_[known->nodes[marked_nodes_].frame] = static_cast<std::int32_t>(marked_nodes_);
  return true;
}

LocalGraph::Turn LocalGraph::find_turn(std::int32_t base, std::int32_t observer) {
  mark(base);
  // As a rule the walk up from the base leads to the observer itself.
  while (node_of_[observer] < 0 && mark_more()) {
  }
  Turn best;
  auto min_edges = static_cast<std::int32_t>(kPathDepth) + 1;
  // Motion is walked in both directions. So a path that turns at a frame which the observer reaches by motion is itself
  // a walk up from the base, and not shorter than the one that is known.
  const bool leads_there = node_of_[observer] >= 0;
  for (std::int32_t depth = 0; depth <= static_cast<std::int32_t>(kWalkDepth) && depth < min_edges; ++depth) {
    const Walk& down = walk(observer, depth);
    if (leads_there && depth > 0 && depth < down.first_loop) continue;
    const Walk& up = walks_[walk_of_[base]];
    for (std::int32_t n = down.level[depth]; n < down.level[depth + 1]; ++n) {
      if (leads_there && depth > 0 && down.nodes[n].by_motion) continue;
      const std::int32_t met = node_of_[down.nodes[n].frame];
      if (met < 0 || up.nodes[met].depth + depth >= min_edges) continue;
      min_edges = up.nodes[met].depth + depth;
      best = {met, n};
    }
  }
  return best;
}

bool LocalGraph::path(std::int32_t base, std::int32_t observer, std::vector<LocalStep>* steps) {
  steps->clear();
  if (base < 0 || observer < 0) return false;
  const Turn turn = find_turn(base, observer);
  if (turn.from_base < 0) return false;
  const auto& up = walks_[walk_of_[base]].nodes;
  const auto& down = walks_[walk_of_[observer]].nodes;
  for (std::int32_t n = turn.from_base; n > 0; n = up[n].parent)
    steps->push_back({up[n].edge, up[n].frame, up[n].forward});
  std::reverse(steps->begin(), steps->end());
  for (std::int32_t n = turn.from_observer; n > 0; n = down[n].parent)
    steps->push_back({down[n].edge, down[down[n].parent].frame, !down[n].forward});
  return true;
}

void LocalGraph::path_tree(std::int32_t base, std::span<const std::int32_t> observers, std::vector<TreeNode>* nodes,
                           std::vector<std::int32_t>* ends) {
  const std::size_t root = nodes->size();
  nodes->push_back({base, -1, -1, false});
  tree_node_of_.assign(1, 0);
  first_child_.assign(1, -1);
  next_sibling_.assign(1, -1);
  const auto add = [&](std::int32_t parent, std::int32_t frame, std::int32_t edge, bool forward) {
    const auto node = static_cast<std::int32_t>(nodes->size() - root);
    nodes->push_back({frame, parent, edge, forward});
    first_child_.push_back(-1);
    next_sibling_.push_back(first_child_[parent]);
    return first_child_[parent] = node;
  };
  for (const std::int32_t observer : observers) {
    const Turn turn = find_turn(base, observer);
    if (turn.from_base < 0) {
      ends->push_back(-1);
      continue;
    }
    const auto& up = walks_[walk_of_[base]].nodes;
    const auto& down = walks_[walk_of_[observer]].nodes;
    tree_node_of_.resize(up.size(), -1);
    upwards_.clear();
    std::int32_t n = turn.from_base;
    for (; tree_node_of_[n] < 0; n = up[n].parent) upwards_.push_back(n);
    std::int32_t node = tree_node_of_[n];
    for (; !upwards_.empty(); upwards_.pop_back()) {
      n = upwards_.back();
      node = tree_node_of_[n] = add(node, up[n].frame, up[n].edge, up[n].forward);
    }
    for (n = turn.from_observer; n > 0; n = down[n].parent) {
      std::int32_t child = first_child_[node];
      while (child >= 0 && (*nodes)[root + child].edge != down[n].edge) child = next_sibling_[child];
      node = child >= 0 ? child : add(node, down[down[n].parent].frame, down[n].edge, !down[n].forward);
    }
    ends->push_back(node);
  }
}

}  // namespace relmap::storage
