#include "server/map/support.h"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "server/map/sorted.h"
#include "storage/graph/binding.h"
#include "storage/graph/observers.h"

namespace relmap::map {

namespace {

// Collects changes of edge support, so that each edge is edited once.
class SupportDelta {
 public:
  explicit SupportDelta(storage::EditableGraph& map) : map_(map) {}

  void add(EdgeId edge, int change) { change_[edge] += change; }

  // Returns the edges whose last use has gone, ascending.
  std::vector<EdgeId> apply() {
    std::vector<EdgeId> unused;
    for (const auto& [id, change] : change_) {
      if (change == 0 || !storage::find_edge(map_, id)) continue;  // the edge may have been deleted with its frame
      storage::Edge& edge = *map_.edit_hot(id.frame).edge(id);
      edge.support = static_cast<std::uint32_t>(static_cast<std::int64_t>(edge.support) + change);
      edge.prior_active = edge.kind == storage::EdgeKind::kPrior || edge.support < storage::kMinSupport;
      if (edge.support == 0) unused.push_back(id);
    }
    return unused;
  }

 private:
  storage::EditableGraph& map_;
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

// What the frames see. Adds `sign` times the paths of these observations to `delta`.
Sightings sightings(const storage::Graph& graph, const std::set<FrameId>& frames, int sign, SupportDelta& delta) {
  std::vector<Sighting> all;
  Sightings found;
  std::vector<LandmarkId> not_needed;
  for (const FrameId frame : frames) {
    const auto warm = graph.warm(frame);
    if (!warm) continue;  // deleted
    for (const LandmarkId landmark : storage::landmarks_seen(graph, *warm, &not_needed))
      all.push_back({landmark, frame});
    for (const LandmarkId landmark : not_needed) found.unreached.push_back({landmark, frame});
  }
  // The walk up from each base is made once, and the path from it to each frame.
  const auto ends = [](const Sighting& sighting) { return std::pair(sighting.landmark.base, sighting.frame); };
  std::ranges::sort(all, {}, ends);
  storage::LocalGraph local(graph);
  std::vector<storage::LocalStep> steps;
  std::vector<int> uses;  // by local edge
  for (auto begin = all.begin(); begin != all.end();) {
    const auto end = std::ranges::upper_bound(begin, all.end(), ends(*begin), {}, ends);
    const bool reached = local.path(local.frame(begin->landmark.base), local.frame(begin->frame), &steps);
    uses.resize(local.edges.size());
    for (const storage::LocalStep& step : steps) uses[step.edge] += sign * static_cast<int>(end - begin);
    auto& list = reached ? found.reached : found.unreached;
    list.insert(list.end(), begin, end);
    begin = end;
  }
  for (std::size_t edge = 0; edge < uses.size(); ++edge)
    if (uses[edge] != 0) delta.add(local.edges[edge].id, uses[edge]);
  std::sort(found.reached.begin(), found.reached.end());
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

// The landmark's list of observers after the change.
std::vector<FrameId> updated(const storage::Graph& graph, storage::FirstObservers& first_observers, LandmarkId landmark,
                             const Change& change) {
  if (storage::resolve(graph, landmark) != landmark) return {};  // it stands for another one now
  std::vector<FrameId> list = graph.hot(landmark.base)->landmarks[landmark.slot].observers;
  const FrameId last = list.empty() ? FrameId() : list.back();
  const bool was_fixed = storage::is_fixed(list);
  const std::size_t removed =
      std::erase_if(list, [&](FrameId f) { return std::binary_search(change.gone.begin(), change.gone.end(), f); });
  list.insert(list.end(), change.come.begin(), change.come.end());
  storage::keep_first_observers(graph, &list);
  // A fixed landmark's list does not contain later observers, which may have to move up. (Besides, a new observer
  // between two passes may make them one.)
  if (!was_fixed || (removed == 0 && storage::is_fixed(list) &&
                     storage::taken_in(*graph.hot(list.back())) <= storage::taken_in(*graph.hot(last))))
    return list;
  return first_observers.of(landmark);
}

}  // namespace

const std::vector<EdgeId>* PathsTo::find(FrameId base) {
  const auto [found, fresh] = paths_.try_emplace(base);
  if (fresh) {
    found->second.reachable = local_.path(local_.frame(base), local_.frame(frame_), &steps_);
    for (const storage::LocalStep& step : steps_) found->second.edges.push_back(local_.edges[step.edge].id);
  }
  return found->second.reachable ? &found->second.edges : nullptr;
}

void add_support(storage::EditableGraph& map, PathsTo& paths) {
  const FrameId id = paths.frame();
  SupportDelta delta(map);
  std::vector<LandmarkId> not_needed;
  for (const LandmarkId& landmark : storage::landmarks_seen(map, *map.warm(id), &not_needed)) {
    const std::vector<EdgeId>* path = paths.find(landmark.base);
    if (!path) {
      insert_sorted(map.edit_hot(landmark.base).unreached, storage::Unreached{landmark.slot, id});
      continue;
    }
    for (const EdgeId edge : *path) delta.add(edge, +1);
    // The list is in the order of arrival, and this frame is the newest.
    if (!storage::is_fixed(map.hot(landmark.base)->landmarks[landmark.slot].observers))
      map.edit_hot(landmark.base).landmarks[landmark.slot].observers.push_back(id);
  }
  for (const LandmarkId landmark : not_needed)
    insert_sorted(map.edit_hot(landmark.base).unreached, storage::Unreached{landmark.slot, id});
  delta.apply();
}

std::vector<EdgeId> change_support(storage::EditableGraph& map, const std::set<FrameId>& frames,
                                   const std::function<void()>& change) {
  SupportDelta delta(map);
  const Sightings before = sightings(map, frames, -1, delta);
  change();
  const Sightings after = sightings(map, frames, +1, delta);
  const auto is_there = [&](LandmarkId landmark) { return map.hot(landmark.base) != nullptr; };
  std::vector<std::pair<LandmarkId, std::vector<FrameId>>> lists;
  storage::FirstObservers first_observers(map);
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
    for (const FrameId frame : changed.gone) std::erase(unreached, storage::Unreached{landmark.slot, frame});
    for (const FrameId frame : changed.come) insert_sorted(unreached, storage::Unreached{landmark.slot, frame});
  }
  return delta.apply();
}

void add_observers(const storage::Graph& graph, LandmarkId landmark, std::set<FrameId>* frames) {
  const auto hot = graph.hot(landmark.base);
  for (const storage::Unreached& item : hot->unreached)
    if (item.slot == landmark.slot) frames->insert(item.observer);
  const std::vector<FrameId>& list = hot->landmarks[landmark.slot].observers;
  if (!storage::is_fixed(list)) {
    frames->insert(list.begin(), list.end());
    return;
  }
  const std::vector<FrameId> near = storage::frames_in_reach(graph, landmark.base);
  frames->insert(near.begin(), near.end());
}

void add_frames_beyond(const storage::Graph& graph, const std::vector<FrameId>& newer_ends, std::set<FrameId>* frames) {
  for (const FrameId frame : storage::frames_above(graph, newer_ends, storage::kWalkDepth - 1)) {
    frames->insert(frame);
    const auto hot = graph.hot(frame);
    for (const storage::Unreached& item : hot->unreached) frames->insert(item.observer);
    bool all_near = false;  // all frames in reach have been added
    for (std::uint32_t slot = 0; slot < hot->landmarks.size(); ++slot) {
      const bool fixed = storage::is_fixed(hot->landmarks[slot].observers);
      if (fixed && all_near) continue;
      add_observers(graph, {frame, slot}, frames);
      all_near = all_near || fixed;
    }
  }
}

}  // namespace relmap::map
