#include "server/route/dijkstra.h"

#include <algorithm>
#include <queue>
#include <set>
#include <unordered_map>
#include <unordered_set>

#include "server/route/edge_access.h"

namespace relmap {

namespace {

constexpr std::int32_t kNoParent = -1;

struct Node {
  FrameId frame;
  std::int32_t parent = kNoParent;
  EdgeId edge;  // from the parent
  bool forward = false;
  bool settled = false;
  double cost = 0;
};

// Ordered by cost, then by frame, so that ties are broken alike in every run.
struct Queued {
  double cost;
  FrameId frame;
  std::uint32_t node;

  bool operator>(const Queued& other) const { return cost != other.cost ? cost > other.cost : frame > other.frame; }
};

class Search {
 public:
  Search(const Graph& graph, const RouteOptions& options, const WorkLimit& work)
      : graph_(graph), options_(options), work_(work) {}

  Result<Route> run(std::span<const FrameId> from, std::span<const FrameId> to);

 private:
  void reach(FrameId frame, double cost, std::int32_t parent, const Neighbour* step);
  void expand(std::uint32_t node);
  bool passable(const Edge& edge, bool forward);
  Route trace(std::uint32_t goal) const;
  Status not_connected(std::span<const FrameId> to) const;

  const Graph& graph_;
  const RouteOptions& options_;
  const WorkLimit& work_;
  std::vector<Node> nodes_;
  std::unordered_map<FrameId, std::uint32_t> index_;
  std::priority_queue<Queued, std::vector<Queued>, std::greater<>> queue_;
  std::unordered_map<SessionNumber, bool> oneway_;
  bool against_oneway_ = false;  // an edge was left out for its direction
};

void Search::reach(FrameId frame, double cost, std::int32_t parent, const Neighbour* step) {
  const auto [it, fresh] = index_.try_emplace(frame, static_cast<std::uint32_t>(nodes_.size()));
  if (fresh) {
    nodes_.emplace_back();
    nodes_.back().frame = frame;
  }
  Node& node = nodes_[it->second];
  if (!fresh && (node.settled || cost >= node.cost)) return;
  node.cost = cost;
  node.parent = parent;
  if (step) {
    node.edge = step->edge;
    node.forward = step->forward;
  }
  queue_.push({cost, frame, it->second});
}

bool Search::passable(const Edge& edge, bool forward) {
  if (forward || edge.kind == EdgeKind::kLoop) return true;
  const SessionNumber number = edge.id.frame.session;
  const auto [it, fresh] = oneway_.try_emplace(number, false);
  if (fresh) {
    const auto session = graph_.session(number);
    it->second = session && session->header.oneway;
  }
  against_oneway_ |= it->second;
  return !it->second;
}

void Search::expand(std::uint32_t index) {
  const FrameId frame = nodes_[index].frame;
  const double cost = nodes_[index].cost;
  const auto hot = graph_.hot(frame);
  if (!hot) return;
  for (const Neighbour& step : neighbours(graph_, frame, *hot)) {
    const EdgeRef edge(graph_, frame, hot, step);
    if (!passable(*edge, step.forward)) continue;
    const double weight = options_.by == RouteBy::kDistance ? length_m(*edge) : time_s(*edge, options_.count_standing);
    reach(step.frame, cost + weight, static_cast<std::int32_t>(index), &step);
  }
}

Result<Route> Search::run(std::span<const FrameId> from, std::span<const FrameId> to) {
  const std::unordered_set<FrameId> goals(to.begin(), to.end());
  for (const FrameId frame : from) reach(frame, 0, kNoParent, nullptr);
  std::size_t settled = 0;
  while (!queue_.empty()) {
    const Queued next = queue_.top();
    queue_.pop();
    Node& node = nodes_[next.node];
    if (node.settled) continue;
    if (next.cost > options_.max_cost)
      return {Reason::COST_LIMIT, "no route within " + std::to_string(options_.max_cost) +
                                      (options_.by == RouteBy::kDistance ? " m" : " s")};
    node.settled = true;
    if (goals.contains(node.frame)) return trace(next.node);
    if (nodes_.size() > work_.max_frames)
      return {Reason::OUT_OF_REACH,
              "no route found within the search's limit of " + std::to_string(work_.max_frames) + " frames"};
    if (settled++ % kWorkStride == 0 && work_.proceed)
      if (Status status = work_.proceed(nodes_.size()); !status.ok()) return status;
    expand(next.node);
  }
  return not_connected(to);
}

Route Search::trace(std::uint32_t goal) const {
  std::vector<std::uint32_t> chain;
  for (auto i = static_cast<std::int32_t>(goal); i != kNoParent; i = nodes_[static_cast<std::size_t>(i)].parent)
    chain.push_back(static_cast<std::uint32_t>(i));
  std::reverse(chain.begin(), chain.end());

  Route route;
  route.frames_touched = nodes_.size();
  route.steps.resize(chain.size());
  for (std::size_t i = 0; i < chain.size(); ++i) {
    RouteStep& step = route.steps[i];
    step.frame = nodes_[chain[i]].frame;
    step.distance_m = route.distance_m;
    step.time_s = route.time_s;
    if (const auto hot = graph_.hot(step.frame)) step.labels = hot->labels;
    if (i + 1 == chain.size()) break;
    const Node& next = nodes_[chain[i + 1]];
    const EdgeRef edge(graph_.hot(next.edge.frame), next.edge);
    step.edge = next.edge;
    step.kind = edge->kind;
    step.T_to_next = walked(*edge, next.forward);
    step.long_loop = is_long_loop(*edge);
    route.long_loops += step.long_loop;
    route.distance_m += length_m(*edge);
    route.time_s += time_s(*edge, options_.count_standing);
  }
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
  std::set<SessionNumber> reached, wanted;
  for (const Node& node : nodes_) reached.insert(node.frame.session);
  for (const FrameId frame : to) wanted.insert(frame.session);
  std::string text = "from the start, accepted edges lead to session(s) " + name_sessions(graph_, reached) +
                     "; the goal is in session(s) " + name_sessions(graph_, wanted);
  if (against_oneway_) text += "; edges against the direction of one-way sessions were left out";
  return {Reason::NOT_CONNECTED, std::move(text)};
}

Status check_ends(const Graph& graph, std::span<const FrameId> frames, const char* end) {
  if (frames.empty()) return {Reason::INVALID_ARGUMENT, std::string("no frame at the ") + end + " of the route"};
  for (const FrameId frame : frames)
    if (!graph.hot(frame)) return {Reason::NO_SUCH_FRAME, "no frame " + frame.to_string()};
  return {};
}

}  // namespace

Result<Route> find_route(const Graph& graph, std::span<const FrameId> from, std::span<const FrameId> to,
                         const RouteOptions& options, const WorkLimit& work) {
  if (Status status = check_ends(graph, from, "start"); !status.ok()) return status;
  if (Status status = check_ends(graph, to, "goal"); !status.ok()) return status;
  return Search(graph, options, work).run(from, to);
}

}  // namespace relmap
