#include "server/map/carried_stretch.h"

#include <algorithm>
#include <map>
#include <memory>
#include <vector>

#include "server/map/sorted.h"

namespace relmap {

namespace {

constexpr std::size_t kMostTried = 4;  // closures, the nearest first
constexpr int kDeepest = 2;            // stretches on the way to a closure that measured another

std::optional<Edge> measure(const Graph& graph, const Edge& step, Drift drift, int depth) {
  std::vector<Edge> carriers;
  for (const EdgeId id : step.carried_by)
    if (auto closure = find_edge(graph, id)) carriers.push_back(std::move(*closure));
  const auto way = [](const Edge& closure) {
    return (closure.carried.first - closure.a.index) + (closure.b.index - closure.carried.last);
  };
  std::stable_sort(carriers.begin(), carriers.end(), [&](const Edge& x, const Edge& y) { return way(x) < way(y); });
  if (carriers.size() > kMostTried) carriers.resize(kMostTried);

  const AcrossCarried across = [&](const Edge& other) -> std::optional<Edge> {
    return depth < kDeepest ? measure(graph, other, drift, depth + 1) : std::nullopt;
  };
  for (const Edge& closure : carriers) {
    const FrameId first{closure.carried.session, closure.carried.first};
    const FrameId last{closure.carried.session, closure.carried.last};
    const auto to_a = back_along_odometry(graph, first, closure.a, across);
    const auto from_b = to_a ? back_along_odometry(graph, closure.b, last, across) : std::nullopt;
    if (!from_b) continue;
    const Uncertain T =
        Uncertain(*to_a, drift) * Uncertain(closure.prior_T_ab, closure.prior_covariance) * Uncertain(*from_b, drift);
    Edge stretch;
    stretch.id = closure.id;
    stretch.kind = EdgeKind::kLoop;
    stretch.a = first;
    stretch.b = last;
    stretch.T_ab = T.T.normalized();
    stretch.covariance = T.covariance;
    return stretch;
  }
  return std::nullopt;
}

template <typename Change>
void for_each_step(EditableGraph& map, const Edge& closure, Change change) {
  if (closure.carried.session == 0) return;
  for (std::uint32_t index = closure.carried.first; index < closure.carried.last; ++index) {
    const FrameId frame{closure.carried.session, index + 1};
    const auto hot = map.hot(frame);
    if (hot && hot->edge({frame, 0})) change(map.edit_hot(frame).edge({frame, 0})->carried_by);
  }
}

}  // namespace

std::optional<Edge> measured_stretch(const Graph& graph, const Edge& step, Drift drift) {
  return measure(graph, step, drift, 0);
}

AcrossCarried across_as_measured(const Graph& graph, Drift drift) {
  const auto known = std::make_shared<std::map<EdgeId, std::optional<Edge>>>();
  return [&graph, drift, known](const Edge& step) {
    const auto [found, fresh] = known->try_emplace(step.id);
    if (fresh) found->second = measured_stretch(graph, step, drift);
    return found->second;
  };
}

void enter_carrier(EditableGraph& map, const Edge& closure) {
  for_each_step(map, closure, [&](std::vector<EdgeId>& carriers) { insert_sorted(carriers, closure.id); });
}

void take_out_carrier(EditableGraph& map, const Edge& closure) {
  for_each_step(map, closure, [&](std::vector<EdgeId>& carriers) { std::erase(carriers, closure.id); });
}

}  // namespace relmap
