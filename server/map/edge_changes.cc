#include "server/map/edge_changes.h"

#include <algorithm>
#include <map>
#include <utility>

namespace relmap::map {

namespace {

std::optional<EdgeStanding> standing(const storage::Edge* edge) {
  return edge ? std::optional<EdgeStanding>(*edge) : std::nullopt;
}

const std::vector<EdgeId>& carriers_of(const std::optional<EdgeStanding>& edge) {
  static const std::vector<EdgeId> kNone;
  return edge ? edge->carried_by : kNone;
}

void add_changes(const storage::FrameHot& before, const storage::FrameHot& after,
                 std::map<EdgeId, EdgeChange>& changes) {
  const auto compare = [&](EdgeId id) {
    const storage::Edge *was = before.edge(id), *is = after.edge(id);
    EdgeChange change;
    change.before = standing(was);
    change.after = standing(is);
    if (change.before == change.after) return;
    const storage::Edge& edge = is ? *is : *was;
    change.id = id;
    change.a = edge.a;
    change.b = edge.b;
    change.kind = edge.kind;
    change.bound = edge.bound;
    change.bound_frames = static_cast<std::uint32_t>(edge.bound_frames.size());
    changes.emplace(id, std::move(change));
  };
  for (const storage::Edge& edge : before.edges) compare(edge.id);
  for (const storage::Edge& edge : after.edges)
    if (!before.edge(edge.id)) compare(edge.id);
}

}  // namespace

storage::FrameHot& EdgeRecorder::edit_hot(FrameId id) {
  if (!before_.contains(id)) before_.emplace(id, graph_.hot(id));
  return graph_.edit_hot(id);
}

std::vector<EdgeChange> EdgeRecorder::changes() const {
  std::map<EdgeId, EdgeChange> by_id;
  for (const auto& [frame, before] : before_)
    if (const auto after = graph_.hot(frame)) add_changes(*before, *after, by_id);
  std::vector<EdgeChange> changes;
  changes.reserve(by_id.size());
  for (auto& [id, change] : by_id) changes.push_back(std::move(change));
  return changes;
}

std::vector<EdgeChange> combined(std::vector<EdgeChange> first, const std::vector<EdgeChange>& second) {
  for (const EdgeChange& change : second) {
    const auto known =
        std::find_if(first.begin(), first.end(), [&](const EdgeChange& earlier) { return earlier.id == change.id; });
    if (known == first.end()) {
      first.push_back(change);
      continue;
    }
    const auto before = known->before;
    *known = change;
    known->before = before;
  }
  std::erase_if(first, [](const EdgeChange& change) { return change.before == change.after; });
  std::sort(first.begin(), first.end(), [](const EdgeChange& x, const EdgeChange& y) { return x.id < y.id; });
  return first;
}

std::vector<EdgeId> also_changed(const std::vector<EdgeChange>& changes, EdgeId edited) {
  std::vector<EdgeId> others;
  for (const EdgeChange& change : changes)
    if (change.kind == storage::EdgeKind::kLoop && change.id != edited && change.before && change.after &&
        change.before->state != change.after->state)
      others.push_back(change.id);
  return others;
}

CarryingChanges carrying_changes(const std::vector<EdgeChange>& changes) {
  CarryingChanges stretches;
  for (const EdgeChange& change : changes) {
    if (change.kind == storage::EdgeKind::kLoop) continue;
    const std::vector<EdgeId>&before = carriers_of(change.before), &after = carriers_of(change.after);
    if (before.empty()) stretches.carried.add(change.a, change.b, after);
    if (after.empty()) stretches.not_carried.add(change.a, change.b, before);
  }
  return stretches;
}

}  // namespace relmap::map
