#include "server/map/support.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "server/map/sorted.h"
#include "storage/binding.h"
#include "storage/path_tree.h"

namespace relmap {

namespace {

// Changes of edge support, gathered first so that each edge is edited once.
class SupportDelta {
 public:
  explicit SupportDelta(Map& map) : map_(map) {}

  // `node` of `tree`; null: out of reach, its observation is stored but not used.
  void add_path(const PathTree& tree, const PathNode* node, int sign) {
    for (; node && node->parent >= 0; node = &tree.nodes[static_cast<std::size_t>(node->parent)])
      change_[node->edge] += sign;
  }

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
  std::optional<PathSearch> paths;  // from the base being looked at; the set is sorted by base
  for (const LandmarkId& id : landmarks) {
    const auto hot = graph.hot(id.base);
    const Landmark& landmark = hot->landmarks[id.slot];
    if (landmark.observers.empty() || (landmark.observers.size() == 1 && landmark.observers[0] == id.base)) continue;
    if (!paths || paths->tree().nodes[0].frame != id.base) paths.emplace(graph, id.base);
    for (const FrameId observer : landmark.observers) delta.add_path(paths->tree(), paths->find(observer), sign);
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

const PathTree& PathsTo::from(FrameId base) {
  const auto found = trees_.find(base);
  if (found != trees_.end()) return found->second;
  return trees_.emplace(base, build_path_tree(graph_, base, {.until = frame_})).first->second;
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
    const PathTree& tree = paths.from(landmark.base);
    delta.add_path(tree, tree.find(id), +1);
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
  for (const auto& [base, distance] : distances) {
    // What a search finds no further away than the edge it finds with the edge and without, in the same order.
    const auto untouched = [base, distance](FrameId observer) {
      const std::uint32_t steps =
          observer.index > base.index ? observer.index - base.index : base.index - observer.index;
      return observer.session == base.session && steps <= distance;  // the session's own edges lead there
    };
    const auto hot = graph.hot(base);
    std::optional<PathSearch> paths;
    for (std::uint32_t slot = 0; slot < hot->landmarks.size(); ++slot)
      for (const FrameId observer : hot->landmarks[slot].observers) {
        if (untouched(observer)) continue;
        if (!paths) paths.emplace(graph, base);
        const PathNode* node = paths->find(observer);
        if (node && node->depth <= distance) continue;
        landmarks.insert({base, slot});
        break;
      }
  }
  return landmarks;
}

}  // namespace relmap
