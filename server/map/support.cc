#include "server/map/support.h"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "server/map/sorted.h"
#include "storage/binding.h"
#include "storage/local_graph.h"
#include "storage/path_tree.h"

namespace relmap {

namespace {

// Paths from bases to observers, over what has been read of the graph so far.
class Paths {
 public:
  explicit Paths(const Graph& graph) : local_(graph) {}

  LocalGraph& local() { return local_; }
  // From a base to all of `observers` that it reaches: nodes() until the next call.
  void search(std::int32_t base, const std::vector<FrameId>& observers) {
    targets_.clear();
    for (const FrameId observer : observers)
      if (const std::int32_t frame = local_.frame(observer); frame >= 0) targets_.push_back(frame);
    nodes_.clear();
    local_.path_tree(base, targets_, &nodes_);
    node_of_.resize(local_.frames.size(), -1);
    for (const std::int32_t frame : set_) node_of_[frame] = -1;
    set_.clear();
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      node_of_[nodes_[n].frame] = static_cast<std::int32_t>(n);
      set_.push_back(nodes_[n].frame);
    }
  }
  const std::vector<LocalGraph::TreeNode>& nodes() const { return nodes_; }
  // -1: out of reach.
  std::int32_t find(FrameId observer) {
    const std::int32_t frame = local_.frame(observer);
    return frame < 0 || static_cast<std::size_t>(frame) >= node_of_.size() ? -1 : node_of_[frame];
  }

 private:
  LocalGraph local_;
  std::vector<std::int32_t> targets_;
  std::vector<LocalGraph::TreeNode> nodes_;
  std::vector<std::int32_t> node_of_;  // by frame; -1: not in nodes_
  std::vector<std::int32_t> set_;      // frames of nodes_
};

// Changes of edge support, gathered first so that each edge is edited once.
class SupportDelta {
 public:
  explicit SupportDelta(Map& map) : map_(map) {}

  void add(EdgeId edge, int change) { change_[edge] += change; }

  void apply() {
    for (const auto& [id, change] : change_) {
      if (change == 0) continue;
      Edge& edge = *map_.edit_hot(id.frame).edge(id);
      edge.support = static_cast<std::uint32_t>(static_cast<std::int64_t>(edge.support) + change);
      edge.prior_active = edge.kind == EdgeKind::kPrior || edge.support < kMinSupport;
    }
  }

 private:
  Map& map_;
  std::map<EdgeId, int> change_;
};

// Adds sign times the paths of all observers of `landmarks`.
void count_paths(const Graph& graph, const std::set<LandmarkId>& landmarks, int sign, SupportDelta& delta) {
  Paths paths(graph);
  std::vector<FrameId> observers;
  std::vector<std::int64_t> beyond;  // by node: observations whose path goes through it
  for (auto first = landmarks.begin(); first != landmarks.end();) {
    // All of one base at once: the set is sorted by base.
    const FrameId base = first->base;
    const std::int32_t root = paths.local().frame(base);
    const auto hot = paths.local().frames[root].hot;
    auto end = first;
    observers.clear();
    for (; end != landmarks.end() && end->base == base; ++end) {
      const auto& of_landmark = hot->landmarks[end->slot].observers;
      observers.insert(observers.end(), of_landmark.begin(), of_landmark.end());
    }
    first = end;
    if (std::all_of(observers.begin(), observers.end(), [&](FrameId observer) { return observer == base; })) continue;
    paths.search(root, observers);
    beyond.assign(paths.nodes().size(), 0);
    for (const FrameId observer : observers)  // out of reach: the observation is stored but not used
      if (const std::int32_t node = paths.find(observer); node >= 0) ++beyond[node];
    for (std::size_t n = paths.nodes().size(); n-- > 1;) {
      const LocalGraph::TreeNode& node = paths.nodes()[n];
      if (beyond[n] != 0) delta.add(paths.local().edges[node.edge].id, sign * static_cast<int>(beyond[n]));
      beyond[node.parent] += beyond[n];
    }
  }
}

// `landmarks` and everything that their claims lead to, in force or not.
std::set<LandmarkId> with_claims(const Graph& graph, std::set<LandmarkId> landmarks) {
  std::vector<LandmarkId> open(landmarks.begin(), landmarks.end());
  while (!open.empty()) {
    const LandmarkId id = open.back();
    open.pop_back();
    for (const AliasClaim& claim : graph.hot(id.base)->landmarks[id.slot].claims)
      if (landmarks.insert(claim.target).second) open.push_back(claim.target);
  }
  return landmarks;
}

}  // namespace

const std::vector<EdgeId>* PathsTo::find(FrameId base) {
  const auto [found, fresh] = paths_.try_emplace(base);
  if (fresh) {
    const std::int32_t root = local_.frame(base), target = local_.frame(frame_);
    nodes_.clear();
    if (root >= 0 && target >= 0) local_.path_tree(root, {&target, 1}, &nodes_);
    found->second.reachable = root == target || nodes_.size() > 1;
    for (std::size_t n = 1; n < nodes_.size(); ++n) found->second.edges.push_back(local_.edges[nodes_[n].edge].id);
  }
  return found->second.reachable ? &found->second.edges : nullptr;
}

void add_support(Map& map, PathsTo& paths) {
  const FrameId id = paths.frame();
  SupportDelta delta(map);
  std::set<LandmarkId> seen;
  for (const Observation& observation : map.warm(id)->observations)
    if (closure_holds(map, observation.origin)) seen.insert(resolve(map, observation.landmark));
  for (const LandmarkId& landmark : seen) {
    insert_sorted(map.edit_hot(landmark.base).landmarks[landmark.slot].observers, id);
    if (landmark.base == id) continue;
    if (const std::vector<EdgeId>* path = paths.find(landmark.base))
      for (const EdgeId edge : *path) delta.add(edge, +1);
  }
  delta.apply();
}

void change_support(Map& map, std::set<LandmarkId> landmarks, std::set<FrameId> frames,
                    const std::function<void()>& change) {
  landmarks = with_claims(map, std::move(landmarks));
  SupportDelta delta(map);
  count_paths(map, landmarks, -1, delta);
  for (const LandmarkId& id : landmarks)
    for (const FrameId observer : map.hot(id.base)->landmarks[id.slot].observers) frames.insert(observer);

  change();

  landmarks = with_claims(map, std::move(landmarks));  // the change may have brought claims
  std::map<LandmarkId, std::vector<FrameId>> observers;
  for (const FrameId frame : frames) {
    const auto warm = map.warm(frame);
    for (const Observation& observation : warm->observations) {
      if (!closure_holds(map, observation.origin)) continue;
      const LandmarkId landmark = resolve(map, observation.landmark);
      if (!landmarks.contains(landmark)) continue;
      auto& list = observers[landmark];
      if (list.empty() || list.back() != frame) list.push_back(frame);
    }
  }
  for (const LandmarkId& id : landmarks) {
    auto& now = observers[id];
    if (map.hot(id.base)->landmarks[id.slot].observers != now)
      map.edit_hot(id.base).landmarks[id.slot].observers = std::move(now);
  }
  count_paths(map, landmarks, +1, delta);
  delta.apply();
}

std::set<LandmarkId> landmarks_near(const Graph& graph, const std::vector<FrameId>& ends) {
  std::map<FrameId, std::uint32_t> distances;  // to the nearest end, edges
  for (const FrameId end : ends)
    for (const PathNode& node : build_path_tree(graph, end).nodes) {
      const auto [at, fresh] = distances.try_emplace(node.frame, node.depth);
      if (!fresh) at->second = std::min(at->second, node.depth);
    }
  std::set<LandmarkId> landmarks;
  Paths paths(graph);
  std::vector<FrameId> far;  // observers of a base's landmarks that may be further away than the edge
  for (const auto& [base, distance] : distances) {
    // What a search finds no further away than the edge it finds with the edge and without, in the same order.
    const auto untouched = [base = base, distance = distance](FrameId observer) {
      const std::uint32_t steps =
          observer.index > base.index ? observer.index - base.index : base.index - observer.index;
      return observer.session == base.session && steps <= distance;  // the session's own edges lead there
    };
    const std::int32_t root = paths.local().frame(base);
    const auto hot = paths.local().frames[root].hot;
    far.clear();
    for (const Landmark& landmark : hot->landmarks)
      for (const FrameId observer : landmark.observers)
        if (!untouched(observer)) far.push_back(observer);
    if (far.empty()) continue;
    paths.search(root, far);
    for (std::uint32_t slot = 0; slot < hot->landmarks.size(); ++slot)
      for (const FrameId observer : hot->landmarks[slot].observers) {
        if (untouched(observer)) continue;
        const std::int32_t node = paths.find(observer);
        if (node >= 0 && paths.nodes()[node].depth <= distance) continue;
        landmarks.insert({base, slot});
        break;
      }
  }
  return landmarks;
}

}  // namespace relmap
