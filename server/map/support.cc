#include "server/map/support.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "storage/binding.h"
#include "storage/observers.h"

namespace relmap {

namespace {

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

struct Sighting {
  LandmarkId landmark;  // in force
  FrameId frame;

  auto operator<=>(const Sighting&) const = default;
};

// What the frames see, ascending; adds `sign` times the paths to it. What is out of reach is stored and not used.
std::vector<Sighting> sightings(const Graph& graph, const std::set<FrameId>& frames, int sign, SupportDelta& delta) {
  std::vector<Sighting> found;
  for (const FrameId frame : frames)
    for (const LandmarkId landmark : landmarks_seen(graph, *graph.warm(frame))) found.push_back({landmark, frame});
  std::sort(found.begin(), found.end());
  LocalGraph local(graph);
  std::vector<LocalStep> steps;
  std::map<std::int32_t, int> uses;  // by local edge
  // By base, so that what leads up from it is looked at once.
  const auto out_of_reach = [&](const Sighting& sighting) {
    if (!local.path(local.frame(sighting.landmark.base), local.frame(sighting.frame), &steps)) return true;
    for (const LocalStep& step : steps) uses[step.edge] += sign;
    return false;
  };
  std::erase_if(found, out_of_reach);
  for (const auto& [edge, count] : uses) delta.add(local.edges[static_cast<std::size_t>(edge)].id, count);
  return found;
}

// The list of a landmark's observers after these came and those went.
std::vector<FrameId> updated(const Graph& graph, LandmarkId landmark, const std::vector<FrameId>& come,
                             const std::vector<FrameId>& gone) {
  std::vector<FrameId> list = graph.hot(landmark.base)->landmarks[landmark.slot].observers;
  const bool full = is_settled(list);
  const std::size_t removed =
      std::erase_if(list, [&](FrameId f) { return std::binary_search(gone.begin(), gone.end(), f); });
  if (full && removed > 0) return first_observers(graph, landmark);
  list.insert(list.end(), come.begin(), come.end());
  keep_first_observers(graph, &list);
  return list;
}

}  // namespace

const std::vector<EdgeId>* PathsTo::find(FrameId base) {
  const auto [found, fresh] = paths_.try_emplace(base);
  if (fresh) {
    const std::int32_t from = local_.frame(base), to = local_.frame(frame_);
    found->second.reachable = from >= 0 && to >= 0 && local_.path(from, to, &steps_);
    if (found->second.reachable)
      for (const LocalStep& step : steps_) found->second.edges.push_back(local_.edges[step.edge].id);
  }
  return found->second.reachable ? &found->second.edges : nullptr;
}

void add_support(Map& map, PathsTo& paths) {
  const FrameId id = paths.frame();
  SupportDelta delta(map);
  for (const LandmarkId& landmark : landmarks_seen(map, *map.warm(id))) {
    const std::vector<EdgeId>* path = paths.find(landmark.base);
    if (!path) continue;
    for (const EdgeId edge : *path) delta.add(edge, +1);
    // The newest frame of all comes last in the list.
    if (!is_settled(map.hot(landmark.base)->landmarks[landmark.slot].observers))
      map.edit_hot(landmark.base).landmarks[landmark.slot].observers.push_back(id);
  }
  delta.apply();
}

void change_support(Map& map, const std::set<FrameId>& frames, const std::function<void()>& change) {
  SupportDelta delta(map);
  const std::vector<Sighting> before = sightings(map, frames, -1, delta);
  change();
  const std::vector<Sighting> after = sightings(map, frames, +1, delta);

  std::map<LandmarkId, std::pair<std::vector<FrameId>, std::vector<FrameId>>> changed;  // come, gone
  std::vector<Sighting> come, gone;
  std::set_difference(after.begin(), after.end(), before.begin(), before.end(), std::back_inserter(come));
  std::set_difference(before.begin(), before.end(), after.begin(), after.end(), std::back_inserter(gone));
  for (const Sighting& sighting : come) changed[sighting.landmark].first.push_back(sighting.frame);
  for (const Sighting& sighting : gone) changed[sighting.landmark].second.push_back(sighting.frame);
  for (const auto& [landmark, frames_of] : changed) {
    std::vector<FrameId> list = updated(map, landmark, frames_of.first, frames_of.second);
    if (list != map.hot(landmark.base)->landmarks[landmark.slot].observers)
      map.edit_hot(landmark.base).landmarks[landmark.slot].observers = std::move(list);
  }
  delta.apply();
}

void add_observers(const Graph& graph, LandmarkId landmark, std::set<FrameId>* frames) {
  const auto hot = graph.hot(landmark.base);
  const std::vector<FrameId>& list = hot->landmarks[landmark.slot].observers;
  if (!is_settled(list)) {
    frames->insert(list.begin(), list.end());
    return;
  }
  const std::vector<FrameId> near = frames_in_reach(graph, landmark.base);
  frames->insert(near.begin(), near.end());
}

void add_frames_beyond(const Graph& graph, FrameId newer_end, std::set<FrameId>* frames) {
  for (const FrameId frame : frames_above(graph, {newer_end}, kWalkDepth - 1)) {
    frames->insert(frame);
    const auto hot = graph.hot(frame);
    bool all_near = false;  // have been added
    for (std::uint32_t slot = 0; slot < hot->landmarks.size(); ++slot) {
      const bool settled = is_settled(hot->landmarks[slot].observers);
      if (settled && all_near) continue;
      add_observers(graph, {frame, slot}, frames);
      all_near = all_near || settled;
    }
  }
}

}  // namespace relmap
