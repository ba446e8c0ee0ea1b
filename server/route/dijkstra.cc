#include "server/route/dijkstra.h"

#include <algorithm>
#include <set>
#include <unordered_map>
#include <unordered_set>

namespace relmap {

namespace {

// A way to a frame that is not settled yet. Ordered by cost, then by frame, then by age, so that ties are broken alike
// in every run.
struct Offer {
  double cost;
  FrameId frame;
  EdgeId edge;  // by which it comes; invalid for a start
  std::uint32_t age;

  bool operator>(const Offer& other) const {
    if (cost != other.cost) return cost > other.cost;
    return frame != other.frame ? frame > other.frame : age > other.age;
  }
};

std::string_view unit_of(const RouteWeights& weights) {
  return weights == kByDistance ? " m" : weights == kByTime || weights == kByTimeStandingToo ? " s" : "";
}

// Distances are kept for the frontier only: a frame that is settled needs none.
class Search {
 public:
  Search(const Graph& graph, const RouteOptions& options, const WorkLimit& work)
      : graph_(graph),
        options_(options),
        work_(work),
        trail_(options.filter.supposed),
        passage_(graph, options.filter) {}

  Result<Route> run(std::span<const FrameId> from, std::span<const FrameId> to);

 private:
  void offer(FrameId frame, double cost, EdgeId edge);
  Offer take_best();
  void expand(const Offer& best, const std::shared_ptr<const FrameHot>& hot, const std::vector<Neighbour>& steps);
  Result<Route> trace(FrameId goal) const;
  Status not_connected(std::span<const FrameId> to) const;

  const Graph& graph_;
  const RouteOptions& options_;
  const WorkLimit& work_;
  Trail trail_;
  std::vector<Offer> frontier_;  // a heap, the best first
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

void Search::expand(const Offer& best, const std::shared_ptr<const FrameHot>& hot,
                    const std::vector<Neighbour>& steps) {
  for (const Neighbour& step : steps) {
    if (trail_.contains(step.frame)) continue;
    const EdgeRef edge(graph_, best.frame, hot, step);
    if (passage_.open(*edge, step.forward)) offer(step.frame, best.cost + options_.weights(costs(*edge)), step.edge);
  }
}

Result<Route> Search::run(std::span<const FrameId> from, std::span<const FrameId> to) {
  std::unordered_set<FrameId> goals;
  for (const FrameId frame : to)
    if (passage_.open(frame)) goals.insert(frame);
  for (const FrameId frame : from)
    if (passage_.open(frame)) offer(frame, 0, {});
  if (goals.empty() || frontier_.empty())
    return {Reason::NOT_CONNECTED, std::string("the ") + (frontier_.empty() ? "start" : "goal") +
                                       " is among the frames that were asked to be avoided"};
  while (!frontier_.empty()) {
    const Offer best = take_best();
    if (trail_.contains(best.frame)) continue;
    if (best.cost > options_.max_cost)
      return {Reason::COST_LIMIT,
              "no route within " + std::to_string(options_.max_cost) + std::string(unit_of(options_.weights))};
    const auto hot = graph_.hot(best.frame);
    if (!hot) continue;
    if (trail_.frames() % kWorkStride == 0 && work_.proceed)
      if (Status status = work_.proceed(trail_.memory_bytes() + frontier_.capacity() * sizeof(Offer)); !status.ok())
        return status;
    const std::vector<Neighbour> steps = neighbours(graph_, best.frame, *hot, options_.filter.supposed);
    trail_.settle(best.frame, steps, best.edge);
    if (goals.contains(best.frame)) return trace(best.frame);
    if (trail_.frames() > work_.max_frames)
      return {Reason::OUT_OF_REACH,
              "no route found within the search's limit of " + std::to_string(work_.max_frames) + " frames"};
    expand(best, hot, steps);
  }
  return not_connected(to);
}

Result<Route> Search::trace(FrameId goal) const {
  Route route;
  route.frames_touched = trail_.frames();
  route.count_standing = options_.count_standing || options_.weights.standing_second > 0;
  auto path = trail_.trace(graph_, goal, work_, [&](const Edge& edge) {
    const EdgeCosts of_edge = costs(edge);
    route.long_loops += is_long_loop(edge);
    route.cost += options_.weights(of_edge);
    route.distance_m += of_edge.metres;
    route.time_s += of_edge.driven_s + (route.count_standing ? of_edge.standing_s : 0);
  });
  if (!path.ok()) return path.status();
  route.path = std::move(path).value();
  return route;
}

std::string name_sessions(const Graph& graph, const std::set<SessionNumber>& numbers) {
  constexpr std::size_t kNamed = 8;
  std::string text;
  std::size_t named = 0;
  for (const SessionNumber number : numbers) {
    if (named == kNamed) return text + " and " + std::to_string(numbers.size() - kNamed) + " more";
    if (named++) text += ", ";
    const auto session = graph.session(number);
    text += std::to_string(number) + (session ? " (" + session->display_name + ")" : "");
  }
  return text;
}

Status Search::not_connected(std::span<const FrameId> to) const {
  std::set<SessionNumber> wanted;
  for (const FrameId frame : to) wanted.insert(frame.session);
  std::string text = "from the start, edges lead to session(s) " + name_sessions(graph_, trail_.sessions()) +
                     "; the goal is in session(s) " + name_sessions(graph_, wanted);
  if (passage_.met_oneway()) text += "; edges against the direction of one-way sessions were left out";
  if (passage_.met_filter()) text += "; frames and edges that were asked to be avoided were left out";
  return {Reason::NOT_CONNECTED, std::move(text)};
}

Status check_ends(const Graph& graph, std::span<const FrameId> frames, const char* end) {
  if (frames.empty()) return {Reason::INVALID_ARGUMENT, std::string("no frame at the ") + end + " of the route"};
  for (const FrameId frame : frames)
    if (!graph.hot(frame)) return {Reason::NO_SUCH_FRAME, "no frame " + frame.to_string()};
  return {};
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
  const Edge& edge = **at->edge;
  step.edge = edge.id;
  step.kind = edge.kind;
  step.T_to_next = walked(edge, at->forward);
  step.long_loop = is_long_loop(edge);
  if (compound_) chain_.append(edge, at->forward);
  distance_m_ += length_m(edge);
  time_s_ += relmap::time_s(edge, standing_);
  return step;
}

Result<Route> find_route(const Graph& graph, std::span<const FrameId> from, std::span<const FrameId> to,
                         const RouteOptions& options, const WorkLimit& work) {
  if (!options.weights.valid()) return {Reason::INVALID_ARGUMENT, "weights are 0, or 1e-9 to 1e9, and not all 0"};
  if (Status status = check_ends(graph, from, "start"); !status.ok()) return status;
  if (Status status = check_ends(graph, to, "goal"); !status.ok()) return status;
  return Search(graph, options, work).run(from, to);
}

}  // namespace relmap
