#include "server/map/carried_stretch.h"

#include <algorithm>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "server/map/own_motion.h"
#include "server/map/sorted.h"

namespace relmap::map {

namespace {

constexpr std::size_t kMaxTried = 4;  // closures, the nearest first
constexpr int kMaxDepth = 2;          // nested stretches: on the odometry to a closure that measured another stretch

// Caches the measured stretches by depth of nesting. Rides near each other lie on the odometry to one another's
// closures, so each would be computed again and again otherwise.
class Measured {
 public:
  Measured(const storage::Graph& graph, Drift drift) : graph_(graph), drift_(drift) {}

  std::optional<storage::Edge> across(const storage::Edge& step, int depth = 0) {
    const auto [found, fresh] = known_.try_emplace({step.id, depth});
    if (fresh) found->second = measure(step, depth);
    return found->second;
  }

 private:
  std::optional<storage::Edge> measure(const storage::Edge& step, int depth) {
    std::vector<storage::Edge> carriers;
    for (const EdgeId id : step.carried_by)
      if (auto closure = storage::find_edge(graph_, id)) carriers.push_back(std::move(*closure));
    const auto way = [](const storage::Edge& closure) {
      const auto own = own_motion(closure);
      return own ? (closure.carried.first - own->from.index) + (closure.b.index - closure.carried.last) : ~0u;
    };
    std::stable_sort(carriers.begin(), carriers.end(),
                     [&](const storage::Edge& x, const storage::Edge& y) { return way(x) < way(y); });
    if (carriers.size() > kMaxTried) carriers.resize(kMaxTried);

    const place::AcrossCarried beyond = [&](const storage::Edge& other) -> std::optional<storage::Edge> {
      return depth < kMaxDepth ? across(other, depth + 1) : std::nullopt;
    };
    for (const storage::Edge& closure : carriers) {
      const FrameId first{closure.carried.session, closure.carried.first};
      const FrameId last{closure.carried.session, closure.carried.last};
      const auto own = own_motion(closure);
      const auto to_from = own ? place::back_along_odometry(graph_, first, own->from, beyond) : std::nullopt;
      const auto from_b = to_from ? place::back_along_odometry(graph_, closure.b, last, beyond) : std::nullopt;
      if (!from_b) continue;
      const Uncertain T = Uncertain(*to_from, drift_) * Uncertain(own->T, own->covariance) * Uncertain(*from_b, drift_);
      storage::Edge stretch;
      stretch.id = closure.id;
      stretch.kind = storage::EdgeKind::kLoop;
      stretch.a = first;
      stretch.b = last;
      stretch.T_ab = T.T.normalized();
      stretch.covariance = T.covariance;
      return stretch;
    }
    return std::nullopt;
  }

  const storage::Graph& graph_;
  const Drift drift_;
  std::map<std::pair<EdgeId, int>, std::optional<storage::Edge>> known_;  // by odometry edge and depth
};

template <typename Change>
void for_each_step(storage::EditableGraph& map, const storage::Edge& closure, Change change) {
  if (closure.carried.session == 0) return;
  for (std::uint32_t index = closure.carried.first; index < closure.carried.last; ++index) {
    const FrameId frame{closure.carried.session, index + 1};
    const auto hot = map.hot(frame);
    if (hot && hot->edge({frame, 0})) change(map.edit_hot(frame).edge({frame, 0})->carried_by);
  }
}

}  // namespace

std::optional<storage::Edge> measured_stretch(const storage::Graph& graph, const storage::Edge& step, Drift drift) {
  return Measured(graph, drift).across(step);
}

place::AcrossCarried across_as_measured(const storage::Graph& graph, Drift drift) {
  const auto measured = std::make_shared<Measured>(graph, drift);
  return [measured](const storage::Edge& step) { return measured->across(step); };
}

void say_carried(storage::EditableGraph& map, EdgeId closure, const storage::FrameRange& stretch) {
  storage::Edge& edge = *map.edit_hot(closure.frame).edge(closure);
  edge.carried = stretch;
  enter_carrier(map, storage::Edge(edge));
}

void enter_carrier(storage::EditableGraph& map, const storage::Edge& closure) {
  for_each_step(map, closure, [&](std::vector<EdgeId>& carriers) { insert_sorted(carriers, closure.id); });
}

void take_out_carrier(storage::EditableGraph& map, const storage::Edge& closure) {
  for_each_step(map, closure, [&](std::vector<EdgeId>& carriers) { std::erase(carriers, closure.id); });
}

}  // namespace relmap::map
