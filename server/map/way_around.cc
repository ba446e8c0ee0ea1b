#include "server/map/way_around.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <optional>

#include "server/map/consistency.h"
#include "server/map/own_motion.h"
#include "server/map/stops.h"
#include "server/map/uncertain.h"
#include "server/route/dijkstra.h"
#include "server/route/overlay/route_search.h"
#include "storage/graph/compounded_chain.h"
#include "storage/graph/precision.h"

namespace relmap::map {

namespace {

// A search frame by frame ends there: it takes 200 ms of a lookup's thread, and in a town that was driven eight times
// it comes 800 m far. With a quarter of this, rides by train are not noticed (docs/decisions/closures.md).
constexpr std::size_t kMaxFrames = std::size_t{1} << 17;
// A stop of which nothing tells is looked for at each of so many queries only, since that means going back through up
// to kMotionReach frames and searching in vain as long as the map has no way.
constexpr std::uint32_t kLateEvery = 16;

bool is_closure_in_force(const storage::Edge& edge) {
  return edge.kind == storage::EdgeKind::kLoop && edge.state == storage::EdgeState::kAccepted;
}

// Whether it replaces a path through a deleted session, of which nobody knows whether somebody stood on it.
bool is_bridge(const storage::Edge& edge) { return edge.verification == storage::Verification::kCompounded; }

bool is_joined_to_another(const storage::Graph& graph, FrameId frame, const storage::FrameHot& hot) {
  const auto joins = [&](const storage::Edge& edge) {
    return is_closure_in_force(edge) && edge.other(frame).session != frame.session;
  };
  return std::any_of(hot.edges.begin(), hot.edges.end(), joins) ||
         std::any_of(hot.incoming.begin(), hot.incoming.end(), [&](EdgeId id) {
           if (id.frame.session == frame.session) return false;
           const auto edge = storage::find_edge(graph, id);
           return edge && joins(*edge);
         });
}

// What was outvoted or taken out tells nothing.
bool tells_of_a_way(const storage::Edge& edge) {
  return edge.around != nullptr &&
         (edge.state == storage::EdgeState::kCandidate || edge.state == storage::EdgeState::kAccepted);
}

// Whether stops that lie further back than the last joined frame are looked for, too: at frames whose index is a
// multiple of kLateEvery, and while ways around one were found a few frames ago, since one closure alone does not tell
// of a ride.
bool looks_further_back(const storage::Graph& graph, FrameId query) {
  if (query.index % kLateEvery == 0) return true;
  for (std::uint32_t back = 1; back < kLateEvery && back <= query.index; ++back)
    if (const auto hot = graph.hot({query.session, query.index - back}))
      if (std::ranges::any_of(hot->edges, tells_of_a_way)) return true;
  return false;
}

// The last frame that is joined to another session before the last stop of which nothing tells whether it was a ride.
std::optional<FrameId> joined_before_stop(const storage::Graph& graph, FrameId query) {
  bool stopped = false, further_back = false;
  Standing standing;
  std::uint32_t covered = query.index;  // back to here closures measure its motion
  for (FrameId at = query; at == query || within_motion_reach(at, query);) {
    const auto hot = graph.hot(at);
    const storage::Edge* motion = hot ? storage::motion_to(*hot) : nullptr;
    if (!hot) return std::nullopt;
    if (at != query) {
      if ((stopped || !further_back) && is_joined_to_another(graph, at, *hot)) {
        if (stopped) return at;
        if (!looks_further_back(graph, query)) return std::nullopt;
        further_back = true;
      }
      for (const storage::Edge& edge : hot->edges)
        if (is_closure_in_force(edge) && !is_bridge(edge))
          if (const auto own = own_motion(edge)) covered = std::min(covered, own->from.index);
    }
    if (!motion || !motion->in_graph() || motion->source == MotionSource::kUnsensed) return std::nullopt;
    if (motion->carried_by.empty() && motion->a.index < covered)
      stopped = standing.is_stop(*motion) || stopped;
    else
      standing.interrupt();
    at = motion->a;
  }
  return std::nullopt;
}

// The transform along a way; nullopt if the way does not tell it.
std::optional<Uncertain> transform_along(const storage::Graph& graph, const route::Path& path) {
  storage::CompoundedChain chain;
  double metres = 0;
  Standing standing;
  route::PathWalk walk(graph, path);
  while (const auto at = walk.next()) {
    if (!at->edge) break;
    const storage::Edge& edge = **at->edge;
    if (!edge.carried_by.empty() || storage::is_unmeasured(edge) || is_bridge(edge) || standing.is_stop(edge))
      return std::nullopt;
    chain.append(edge, at->forward);
    metres += route::length_m(edge);
  }
  const ConsistencyRules rules;
  return Uncertain({path.to, chain.T(), chain.covariance(), metres}, Drift{rules.drift_share, rules.drift_radians});
}

// The map through which a way is sought: the newest, with its cells, or `graph`.
class Ways {
 public:
  Ways(const storage::Graph& graph, const RouteMap& newest) : graph_(graph) {
    if (newest) newest_ = newest();
  }

  // The transform along the shortest way or, if that does not tell it, along the one with the least standing.
  std::optional<Uncertain> measured(FrameId from, FrameId to) const {
    route::RouteOptions options;
    options.filter.against_oneway = true;
    for (const route::RouteWeights& weights : {route::kByDistance, kWithoutStops}) {
      options.weights = weights;
      const auto way = cheapest(from, to, options);
      if (!way) return std::nullopt;  // no way, whatever it costs
      if (auto told = transform_along(newest_ ? *newest_->view : graph_, *way)) return told;
    }
    return std::nullopt;
  }

 private:
  std::optional<route::Path> cheapest(FrameId from, FrameId to, const route::RouteOptions& options) const {
    const route::WorkLimit work{.max_frames = kMaxFrames, .proceed = {}};
    if (!newest_) return path_of(route::find_route(graph_, {&from, 1}, {&to, 1}, options, work));
    auto answer = route::search_route(*newest_, {&from, 1}, {&to, 1}, options, 0, work);
    return path_of(answer.ok() ? Result(std::move(answer->route)) : answer.status());
  }
  static std::optional<route::Path> path_of(Result<route::Route> route) {
    if (route.ok()) return std::move(route->path);
    const Reason reason = route.reason();
    if (reason != Reason::NOT_CONNECTED && reason != Reason::OUT_OF_REACH && reason != Reason::NO_SUCH_FRAME)
      throw StatusError(route.status());
    return std::nullopt;
  }

  const storage::Graph& graph_;
  std::optional<route::RouteIndex::Snapshot> newest_;
};

std::shared_ptr<const storage::WayAround> find_way_around(const storage::Graph& graph,
                                                          const storage::ClosureProposalRecord& proposal,
                                                          const RouteMap& newest) {
  if (within_motion_reach(proposal.match, proposal.query)) return nullptr;
  const auto from = joined_before_stop(graph, proposal.query);
  if (!from) return nullptr;
  const auto to_match = Ways(graph, newest).measured(*from, proposal.match);
  if (!to_match) return nullptr;
  const Uncertain way = *to_match * Uncertain(proposal.T_match_query, proposal.covariance);
  return std::make_shared<const storage::WayAround>(
      storage::WayAround{*from, storage::rounded(way.T.normalized()), storage::rounded(way.covariance)});
}

}  // namespace

std::shared_ptr<const storage::WayAround> way_around(const storage::Graph& graph,
                                                     const storage::ClosureProposalRecord& proposal,
                                                     const RouteMap& newest) try {
  return find_way_around(graph, proposal, newest);
} catch (const StatusError& error) {
  if (error.status().reason() == Reason::VIEW_EXPIRED) throw;
  // The search reads much of the map. What is damaged somewhere there must not cost this frame its closure.
  spdlog::warn("no way around a stop is known for {}: {}", proposal.query.to_string(), error.status().to_string());
  return nullptr;
}

}  // namespace relmap::map
