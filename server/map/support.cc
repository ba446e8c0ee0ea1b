#include "server/map/support.h"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "server/map/sorted.h"
#include "storage/binding.h"
#include "storage/observers.h"

namespace relmap {

namespace {

// Changes of edge support, gathered first so that each edge is edited once.
class SupportDelta {
 public:
  explicit SupportDelta(EditableGraph& map) : map_(map) {}

  void add(EdgeId edge, int change) { change_[edge] += change; }

  // Returns the edges whose last use has gone, ascending.
  std::vector<EdgeId> apply() {
    std::vector<EdgeId> unused;
    for (const auto& [id, change] : change_) {
      if (change == 0 || !find_edge(map_, id)) continue;  // it may have gone with its frame
      Edge& edge = *map_.edit_hot(id.frame).edge(id);
      edge.support = static_cast<std::uint32_t>(static_cast<std::int64_t>(edge.support) + change);
      edge.prior_active = edge.kind == EdgeKind::kPrior || edge.support < kMinSupport;
      if (edge.support == 0) unused.push_back(id);
    }
    return unused;
  }

 private:
  EditableGraph& map_;
  std::map<EdgeId, int> change_;
};

struct Sighting {
  LandmarkId landmark;  // in force
  FrameId frame;

  auto operator<=>(const Sighting&) const = default;
};
struct Sightings {
  std::vector<Sighting> reached, unreached;  // ascending
};

// What the frames see; adds `sign` times the paths to it.
Sightings sightings(const Graph& graph, const std::set<FrameId>& frames, int sign, SupportDelta& delta) {
  std::vector<Sighting> all;
  Sightings found;
  std::vector<LandmarkId> not_needed;
  for (const FrameId frame : frames) {
    const auto warm = graph.warm(frame);
    if (!warm) continue;  // it has gone
    for (const LandmarkId landmark : landmarks_seen(graph, *warm, &not_needed)) all.push_back({landmark, frame});
    for (const LandmarkId landmark : not_needed) found.unreached.push_back({landmark, frame});
  }
  std::sort(all.begin(), all.end());  // by base, so that what leads up from it is looked at once
  LocalGraph local(graph);
  std::vector<LocalStep> steps;
  std::map<std::int32_t, int> uses;  // by local edge
  for (const Sighting& sighting : all) {
    const bool reached = local.path(local.frame(sighting.landmark.base), local.frame(sighting.frame), &steps);
    for (const LocalStep& step : steps) uses[step.edge] += sign;
    (reached ? found.reached : found.unreached).push_back(sighting);
  }
  for (const auto& [edge, count] : uses) delta.add(local.edges[static_cast<std::size_t>(edge)].id, count);
  std::sort(found.unreached.begin(), found.unreached.end());
  return found;
}

struct Change {
  std::vector<FrameId> come, gone;
};
// By landmark.
std::map<LandmarkId, Change> changes(const std::vector<Sighting>& before, const std::vector<Sighting>& after) {
  std::vector<Sighting> come, gone;
  std::set_difference(after.begin(), after.end(), before.begin(), before.end(), std::back_inserter(come));
  std::set_difference(before.begin(), before.end(), after.begin(), after.end(), std::back_inserter(gone));
  std::map<LandmarkId, Change> changed;
  for (const Sighting& sighting : come) changed[sighting.landmark].come.push_back(sighting.frame);
  for (const Sighting& sighting : gone) changed[sighting.landmark].gone.push_back(sighting.frame);
  return changed;
}

// The list of a landmark's observers after the change.
std::vector<FrameId> updated(const Graph& graph, FirstObservers& first_observers, LandmarkId landmark,
                             const Change& change) {
  if (resolve(graph, landmark) != landmark) return {};  // it means another now
  std::vector<FrameId> list = graph.hot(landmark.base)->landmarks[landmark.slot].observers;
  const FrameId last = list.empty() ? FrameId() : list.back();
  const bool settled = is_settled(list);
  const std::size_t removed =
      std::erase_if(list, [&](FrameId f) { return std::binary_search(change.gone.begin(), change.gone.end(), f); });
  list.insert(list.end(), change.come.begin(), change.come.end());
  keep_first_observers(graph, &list);
  // A settled landmark's list does not tell who came after its last. (A newcomer may make one pass of two.)
  if (!settled || (removed == 0 && is_settled(list) && taken_in(*graph.hot(list.back())) <= taken_in(*graph.hot(last))))
    return list;
  return first_observers.of(landmark);
}

}  // namespace

const std::vector<EdgeId>* PathsTo::find(FrameId base) {
  const auto [found, fresh] = paths_.try_emplace(base);
  if (fresh) {
    found->second.reachable = local_.path(local_.frame(base), local_.frame(frame_), &steps_);
    for (const LocalStep& step : steps_) found->second.edges.push_back(local_.edges[step.edge].id);
  }
  return found->second.reachable ? &found->second.edges : nullptr;
}

void add_support(EditableGraph& map, PathsTo& paths) {
  const FrameId id = paths.frame();
  SupportDelta delta(map);
  std::vector<LandmarkId> not_needed;
  for (const LandmarkId& landmark : landmarks_seen(map, *map.warm(id), &not_needed)) {
    const std::vector<EdgeId>* path = paths.find(landmark.base);
    if (!path) {
      insert_sorted(map.edit_hot(landmark.base).unreached, Unreached{landmark.slot, id});
      continue;
    }
    for (const EdgeId edge : *path) delta.add(edge, +1);
    // The newest frame of all comes last in the list.
    if (!is_settled(map.hot(landmark.base)->landmarks[landmark.slot].observers))
      map.edit_hot(landmark.base).landmarks[landmark.slot].observers.push_back(id);
  }
  for (const LandmarkId landmark : not_needed)
    insert_sorted(map.edit_hot(landmark.base).unreached, Unreached{landmark.slot, id});
  delta.apply();
}

std::vector<EdgeId> change_support(EditableGraph& map, const std::set<FrameId>& frames,
                                   const std::function<void()>& change) {
  SupportDelta delta(map);
  const Sightings before = sightings(map, frames, -1, delta);
  change();
  const Sightings after = sightings(map, frames, +1, delta);
  const auto is_there = [&](LandmarkId landmark) { return map.hot(landmark.base) != nullptr; };
  std::vector<std::pair<LandmarkId, std::vector<FrameId>>> lists;
  FirstObservers first_observers(map);
  for (const auto& [landmark, changed] : changes(before.reached, after.reached)) {
    if (!is_there(landmark)) continue;
    std::vector<FrameId> list = updated(map, first_observers, landmark, changed);
    if (list != map.hot(landmark.base)->landmarks[landmark.slot].observers)
      lists.emplace_back(landmark, std::move(list));
  }
  for (auto& [landmark, list] : lists) map.edit_hot(landmark.base).landmarks[landmark.slot].observers = std::move(list);
  for (const auto& [landmark, changed] : changes(before.unreached, after.unreached)) {
    if (!is_there(landmark)) continue;
    auto& unreached = map.edit_hot(landmark.base).unreached;
    for (const FrameId frame : changed.gone) std::erase(unreached, Unreached{landmark.slot, frame});
    for (const FrameId frame : changed.come) insert_sorted(unreached, Unreached{landmark.slot, frame});
  }
  return delta.apply();
}

void add_observers(const Graph& graph, LandmarkId landmark, std::set<FrameId>* frames) {
  const auto hot = graph.hot(landmark.base);
  for (const Unreached& item : hot->unreached)
    if (item.slot == landmark.slot) frames->insert(item.observer);
  const std::vector<FrameId>& list = hot->landmarks[landmark.slot].observers;
  if (!is_settled(list)) {
    frames->insert(list.begin(), list.end());
    return;
  }
  const std::vector<FrameId> near = frames_in_reach(graph, landmark.base);
  frames->insert(near.begin(), near.end());
}

void add_frames_beyond(const Graph& graph, const std::vector<FrameId>& newer_ends, std::set<FrameId>* frames) {
  for (const FrameId frame : frames_above(graph, newer_ends, kWalkDepth - 1)) {
    frames->insert(frame);
    const auto hot = graph.hot(frame);
    for (const Unreached& item : hot->unreached) frames->insert(item.observer);
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
