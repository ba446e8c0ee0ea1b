#include "server/route/dijkstra.h"

#include <algorithm>
#include <unordered_set>

#include "server/route/refusal.h"
#include "storage/graph/frame.h"

namespace relmap::route {

namespace {

// A path to a frame that is not settled yet. Ordered by cost, then by frame, then by age, so that ties are broken in
// the same way in every run.
struct Offer {
  double cost;
  FrameId frame;
  EdgeId edge;  // the last edge of the path; invalid for a start
  std::uint32_t age;

  bool operator>(const Offer& other) const {
    if (cost != other.cost) return cost > other.cost;
    return frame != other.frame ? frame > other.frame : age > other.age;
  }
};

// Dijkstra's algorithm. Costs are kept for the frontier only, since settled frames need none.
class Search {
 public:
  Search(const storage::Graph& graph, const RouteOptions& options, const WorkLimit& work)
      : graph_(graph),
        options_(options),
        work_(work),
        trail_(options.filter.supposed),
        passage_(graph, options.filter) {}

  Result<Route> run(std::span<const FrameId> from, std::span<const FrameId> to);

 private:
  void offer(FrameId frame, double cost, EdgeId edge);
  Offer take_best();
  void expand(const Offer& best, const std::shared_ptr<const storage::FrameHot>& hot,
              const std::vector<storage::Neighbour>& steps);
  Result<Route> trace(FrameId goal) const;

  const storage::Graph& graph_;
  const RouteOptions& options_;
  const WorkLimit& work_;
  Trail trail_;
  std::vector<Offer> frontier_;  // a heap with the cheapest first
  std::uint32_t offers_ = 0;
  Passage passage_;
};

void Search::offer(FrameId frame, double cost, EdgeId edge) {
  frontier_.push_back({cost, frame, edge, offers_++});
  std::push_heap(frontier_.begin(), frontier_.end(), std::greater<>());
}

Offer Search::take_best() {
  std::pop_heap(frontier_.begin(), frontier_.end(), std::greater<>());
  const Offer best = frontier_.back();
  frontier_.pop_back();
  return best;
}

void Search::expand(const Offer& best, const std::shared_ptr<const storage::FrameHot>& hot,
                    const std::vector<storage::Neighbour>& steps) {
  for (const storage::Neighbour& step : steps) {
    if (trail_.contains(step.frame)) continue;
    const EdgeRef edge(graph_, best.frame, hot, step);
    if (passage_.open(*edge, step.forward))
      offer(step.frame, best.cost + options_.weights(*edge) * options_.penalty(best.frame, step.frame), step.edge);
  }
}

Result<Route> Search::run(std::span<const FrameId> from, std::span<const FrameId> to) {
  std::unordered_set<FrameId> goals;
  for (const FrameId frame : to)
    if (passage_.open(frame)) goals.insert(frame);
  for (const FrameId frame : from)
    if (passage_.open(frame)) offer(frame, 0, {});
  if (goals.empty() || frontier_.empty()) return end_refused(frontier_.empty());
  while (!frontier_.empty()) {
    const Offer best = take_best();
    if (trail_.contains(best.frame)) continue;
    if (best.cost > options_.max_cost) return beyond(options_.max_cost, options_.weights);
    const auto hot = graph_.hot(best.frame);
    if (!hot) continue;
    if (trail_.frames() % kWorkStride == 0 && work_.proceed)
      if (Status status = work_.proceed(trail_.memory_bytes() + frontier_.capacity() * sizeof(Offer)); !status.ok())
        return status;
    const std::vector<storage::Neighbour> steps =
        storage::neighbours(graph_, best.frame, *hot, options_.filter.supposed);
    trail_.settle(best.frame, steps, best.edge);
    if (goals.contains(best.frame)) return trace(best.frame);
    if (trail_.frames() > work_.max_frames)
      return {Reason::OUT_OF_REACH,
              "no route found within the search's limit of " + std::to_string(work_.max_frames) + " frames"};
    expand(best, hot, steps);
  }
  return not_connected(graph_, trail_.sessions(), to, passage_.met_oneway(), passage_.met_filter());
}

Result<Route> Search::trace(FrameId goal) const {
  Route route;
  route.frames_touched = trail_.frames();
  route.count_standing = options_.count_standing || options_.weights.standing_second > 0;
  auto path =
      trail_.trace(graph_, goal, work_, [&](const storage::Edge& edge) { route.count(edge, options_.weights(edge)); });
  if (!path.ok()) return path.status();
  route.path = std::move(path).value();
  route.carried.reverse();  // the path was traced from its end
  route.unmeasured.reverse();
  return route;
}

}  // namespace

std::optional<RouteStep> RouteWalk::next() {
  const auto at = walk_.next();
  if (!at) return std::nullopt;
  RouteStep step;
  step.frame = at->frame;
  step.distance_m = distance_m_;
  step.time_s = time_s_;
  step.labels = at->hot->labels;
  if (compound_) {
    step.T_start_this = chain_.T();
    step.covariance = chain_.covariance();
  }
  if (!at->edge) return step;
  const storage::Edge& edge = **at->edge;
  step.edge = edge.id;
  step.kind = edge.kind;
  step.T_to_next = walked(edge, at->forward);
  step.long_loop = is_long_loop(edge);
  step.carried = !edge.carried_by.empty();
  step.unmeasured = storage::is_unmeasured(edge);
  if (compound_) chain_.append(edge, at->forward);
  distance_m_ += length_m(edge);
  time_s_ += relmap::route::time_s(edge, standing_);
  return step;
}

Result<Route> find_route(const storage::Graph& graph, std::span<const FrameId> from, std::span<const FrameId> to,
                         const RouteOptions& options, const WorkLimit& work) {
  if (Status status = check_weights(options.weights); !status.ok()) return status;
  if (Status status = check_ends(from, to); !status.ok()) return status;
  for (const auto& ends : {from, to})
    for (const FrameId frame : ends)
      if (!graph.hot(frame)) return no_such_frame(frame);
  return Search(graph, options, work).run(from, to);
}

}  // namespace relmap::route
