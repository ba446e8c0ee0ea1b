#include "server/map/unmeasured_steps.h"

#include <set>
#include <utility>

#include "storage/local_graph.h"
#include "storage/unmeasured.h"

namespace relmap {

namespace {

struct PathEdge {
  Edge edge;
  bool forward = false;
};

// From the closure's older end to its newer one; empty: out of reach.
std::vector<PathEdge> path_between(const Graph& graph, const Edge& closure) {
  LocalGraph local(graph);
  std::vector<LocalStep> steps;
  std::vector<PathEdge> path;
  if (!local.path(local.frame(closure.a), local.frame(closure.b), &steps)) return path;
  for (const LocalStep& step : steps)
    path.push_back({*local.edges[static_cast<std::size_t>(step.edge)].record, step.forward});
  return path;
}

SE3 walked(const PathEdge& step) { return step.forward ? step.edge.T_ab : step.edge.T_ab.inverse(); }

bool is_frozen(const Graph& graph, SessionNumber session) {
  return graph.session(session)->state == SessionState::kFrozen;
}

}  // namespace

void measure_steps(EditableGraph& map, const std::vector<EdgeId>& coming, const std::vector<EdgeId>& going) {
  std::set<EdgeId> open;  // supported by what goes
  for (const EdgeId id : going)
    for (const PathEdge& step : path_between(map, *find_edge(map, id)))
      if (is_guessed(step.edge)) open.insert(step.edge.id);
  std::set<EdgeId> measured;
  for (const EdgeId id : coming) {
    const auto closure = find_edge(map, id);
    if (!is_metric(closure->verification)) continue;
    const std::vector<PathEdge> path = path_between(map, *closure);
    const PathEdge* least_known = nullptr;
    const auto variance = [](const PathEdge& step) { return step.edge.prior_covariance.trace(); };
    for (const PathEdge& step : path)
      if ((is_unmeasured(step.edge) || open.contains(step.edge.id)) && !is_frozen(map, step.edge.id.frame.session) &&
          (!least_known || variance(step) > variance(*least_known)))
        least_known = &step;
    if (!least_known || !measured.insert(least_known->edge.id).second) continue;
    SE3 before, after;  // the ways from the closure's a to the step, and from there to its b
    for (const PathEdge& step : path) {
      if (&step < least_known) before = before * walked(step);
      if (&step > least_known) after = after * walked(step);
    }
    const SE3 across = before.inverse() * closure->T_ab * after.inverse();
    const EdgeId step = least_known->edge.id;
    map.edit_hot(step.frame).edge(step)->T_ab = (least_known->forward ? across : across.inverse()).normalized();
  }
}

void forget_measured_steps(EditableGraph& map, const std::vector<EdgeId>& gone) {
  for (const EdgeId id : gone)
    for (const PathEdge& step : path_between(map, *find_edge(map, id)))
      if (is_guessed(step.edge) && step.edge.support == 0 && !is_frozen(map, step.edge.id.frame.session)) {
        Edge& edge = *map.edit_hot(step.edge.id.frame).edge(step.edge.id);
        edge.T_ab = edge.prior_T_ab;
      }
}

}  // namespace relmap
