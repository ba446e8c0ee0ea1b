#include "server/map/unmeasured_steps.h"

#include <set>

#include "proto/geometry/covariance.h"
#include "server/map/uncertain.h"
#include "server/route/edge_access.h"
#include "storage/graph/frame.h"
#include "storage/graph/local_graph.h"

namespace relmap::map {

namespace {

constexpr double kNearMetres = 0.3, kNearRadians = 0.1;  // from within these relaxation converges to the place

struct PathStep {
  storage::Edge edge;
  bool forward = false;

  SE3 T() const { return route::walked(edge, forward); }
};

// The path from a to b; empty if there is none.
std::vector<PathStep> path_between(const storage::Graph& graph, FrameId a, FrameId b) {
  storage::LocalGraph local(graph);
  std::vector<storage::LocalStep> steps;
  std::vector<PathStep> path;
  if (!local.path(local.frame(a), local.frame(b), &steps)) return path;
  for (const storage::LocalStep& step : steps)
    path.push_back({*local.edges[static_cast<std::size_t>(step.edge)].record, step.forward});
  return path;
}

bool is_near(const SE3& T) { return T.t.norm() <= kNearMetres && rotation_angle(T.R) <= kNearRadians; }

bool allows(const storage::Edge& step, const SE3& T_ab) {
  const Vector6 change = (step.prior_T_ab.inverse() * T_ab).log();
  const double chi2 = mahalanobis_squared(change, step.prior_covariance);
  return chi2 <= kChi2With6At99;  // false for NaN
}

// Sets the step's transform, with the covariance of the guess and without correlation to its neighbours.
void set_step(storage::EditableGraph& map, EdgeId id, const SE3& T_ab) {
  storage::Edge& step = *map.edit_hot(id.frame).edge(id);
  step.T_ab = T_ab;
  step.covariance = step.prior_covariance;
  step.correlation_with_previous = {};
  if (const auto next = storage::next_in_session(id.frame, *map.hot(id.frame)))
    if (storage::Edge* const after = map.edit_hot(*next).edge({*next, 0})) after->correlation_with_previous = {};
}

}  // namespace

void measure_steps(storage::EditableGraph& map, const std::vector<EdgeId>& coming, bool others_go,
                   std::vector<FrameId>* seeds) {
  std::set<EdgeId> measured;
  const auto is_open = [&](const storage::Edge& step) {
    return (storage::is_unmeasured(step) || (others_go && storage::is_guessed(step))) && step.carried_by.empty() &&
           !measured.contains(step.id) && !storage::is_frozen(*map.session(step.id.frame.session));
  };
  for (const EdgeId id : coming) {
    const auto closure = storage::find_edge(map, id);
    if (closure->in_graph() || closure->carried.session != 0 || !storage::is_metric(closure->verification)) continue;
    const std::vector<PathStep> path = path_between(map, closure->a, closure->b);
    std::size_t worst = path.size();  // the step with the largest prior covariance
    SE3 whole;
    for (std::size_t i = 0; i < path.size(); ++i) {
      whole = whole * path[i].T();
      if (is_open(path[i].edge) &&
          (worst == path.size() || path[i].edge.prior_covariance.trace() > path[worst].edge.prior_covariance.trace()))
        worst = i;
    }
    if (worst == path.size() || is_near(closure->T_ab.inverse() * whole)) continue;
    SE3 before, after;
    for (std::size_t i = 0; i < worst; ++i) before = before * path[i].T();
    for (std::size_t i = worst + 1; i < path.size(); ++i) after = after * path[i].T();
    const PathStep& step = path[worst];
    const SE3 across = before.inverse() * closure->T_ab * after.inverse();
    const SE3 T_ab = (step.forward ? across : across.inverse()).normalized();
    if (!allows(step.edge, T_ab)) continue;
    set_step(map, step.edge.id, T_ab);
    measured.insert(step.edge.id);
    seeds->push_back(step.edge.a);
    seeds->push_back(step.edge.b);
  }
}

void forget_steps(storage::EditableGraph& map, const std::vector<EdgeId>& unused) {
  for (const EdgeId id : unused)
    if (const auto step = storage::find_edge(map, id);
        step && step->in_graph() && storage::is_guessed(*step) && !storage::is_frozen(*map.session(id.frame.session)))
      set_step(map, id, step->prior_T_ab);
}

}  // namespace relmap::map
