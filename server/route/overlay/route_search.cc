#include "server/route/overlay/route_search.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "server/route/overlay/overlay_search.h"
#include "server/route/overlay/reachability.h"

namespace relmap::route {

namespace {

bool too_stale(const RouteIndex::Snapshot& map) {
  return map.stale.size() > std::max<std::size_t>(100, map.overlay->tree().chunks() / 10);
}

// The question to the cells, or UNSUPPORTED with the reason why cells cannot answer it.
Result<OverlayQuery> as_cells_have_it(const RouteIndex::Snapshot& map, const RouteOptions& options) {
  const auto without = [](std::string why) { return Status(Reason::UNSUPPORTED, std::move(why)); };
  if (!map.overlay) return without(map.missing_because);
  OverlayQuery query;
  const auto metrics = map.overlay->metrics();
  const auto metric = std::find(metrics.begin(), metrics.end(), options.weights);
  if (metric == metrics.end())
    return without("there are cells for " + std::to_string(metrics.size()) +
                   " kinds of cost, and this is none of them (routes.mixes of the configuration)");
  query.metric = static_cast<std::size_t>(metric - metrics.begin());
  if (too_stale(map))
    return without("more than a tenth of the map has changed, which the cells do not know yet" +
                   (map.late_because.empty() ? "" : ": " + map.late_because));
  query.stale = map.stale;
  if (options.filter.against_oneway && map.view->session_counts().oneway > 0)
    return without("cells keep to the directions of one-way sessions");
  auto opened = cells_to_open(*map.overlay, options.filter);
  if (!opened) return without("what is to be avoided, or supposed, lies in more than a tenth of the cells");
  query.opened = *std::move(opened);
  query.filter = options.filter;
  query.filter.against_oneway = false;  // no session is one-way
  query.max_cost = options.max_cost;
  return query;
}

Result<Route> route_by_cells(const RouteIndex::Snapshot& map, const OverlayQuery& query, std::span<const FrameId> from,
                             std::span<const FrameId> to, bool count_standing, const WorkLimit& work) {
  try {
    auto route = find_route(*map.overlay, *map.view, query, from, to, work);
    if (!route.ok()) return route.status();
    if (Status status = unpack(*map.overlay, *map.view, query.metric, *route, work); !status.ok()) return status;
    return follow(*map.overlay, *map.view, query.metric, *route, count_standing, work);
  } catch (const StatusError& error) {
    return error.status();
  }
}

// One question, and the searches that answer it.
class RouteSearch {
 public:
  RouteSearch(const RouteIndex::Snapshot& map, std::span<const FrameId> from, std::span<const FrameId> to,
              const RouteOptions& options, const WorkLimit& work)
      : map_(map), from_(from), to_(to), options_(options), work_(work) {}

  Result<RouteAnswer> answer(std::uint64_t near_steps) {
    const auto query = as_cells_have_it(map_, options_);
    if (!query.ok()) {
      answer_.frame_by_frame = query.status().message();
      // Checked first since, if no edges join the ends, Dijkstra would have to search all that is joined to the start.
      if (Status status = check_joined(); !status.ok()) return with_near(std::move(status), near_steps);
      return frame_by_frame();
    }
    Result<Route> route = route_by_cells(map_, *query, from_, to_, options_.count_standing, work_);
    // Frame by frame it may still succeed: cells read all frames of a chunk, of which a damaged one may not be on the
    // route, and they need memory of their own.
    if (const Reason reason = route.reason();
        reason == Reason::DATA_LOSS || reason == Reason::IO_ERROR || reason == Reason::BUDGET_EXCEEDED) {
      answer_.frame_by_frame = route.status().message();
      return frame_by_frame();
    }
    return with_near(std::move(route), near_steps);
  }

 private:
  Result<RouteAnswer> frame_by_frame() { return as_answer(find_route(*map_.view, from_, to_, options_, work_)); }

  // NOT_CONNECTED if the cells show that no edges join the ends, even though they cannot answer the question itself: a
  // filter only removes edges, unless it allows ways against one-way sessions. Closures that only bind, which every
  // question supposes in addition, are followed around the start (with_near()).
  Status check_joined() const {
    const RouteFilter& filter = options_.filter;
    if (!map_.overlay || too_stale(map_) || filter.supposed.candidates || filter.supposed.quarantined ||
        filter.against_oneway)
      return {};
    try {
      return route::check_joined(*map_.overlay, *map_.view, map_.stale, from_, to_, work_);
    } catch (const StatusError& error) {
      const Reason reason = error.status().reason();
      return reason == Reason::DEADLINE ? error.status() : Status();
    }
  }

  // Cells do not contain closures that only bind. If the route that they found is short, or if they found none,
  // searches frame by frame around the start with these closures: if that finds the goal, its route is the best one.
  Result<RouteAnswer> with_near(Result<Route> by_cells, std::uint64_t near_steps) {
    const Reason reason = by_cells.reason();
    const bool refused = reason == Reason::NOT_CONNECTED || reason == Reason::COST_LIMIT;
    if (by_cells.ok() ? by_cells->steps() > near_steps : !refused) return as_answer(std::move(by_cells));
    Result<Route> near = Status(Reason::OUT_OF_REACH, "");
    WorkLimit around = work_;
    around.max_frames = std::min<std::size_t>(around.max_frames, kNearFramesAStep * near_steps);
    try {
      near = find_route(*map_.view, from_, to_, options_, around);
    } catch (const StatusError&) {  // what cannot be read there may not be on the route
    }
    if (near.ok()) {
      answer_.near = true;
      answer_.no_way_by_edges = !by_cells.ok();
      return as_answer(std::move(near));
    }
    if (by_cells.ok()) return as_answer(std::move(by_cells));
    // If the search around the start came to its own limit, the answer by edges stands.
    if (near.reason() != Reason::OUT_OF_REACH && near.reason() != Reason::BUDGET_EXCEEDED) return near.status();
    return Status(reason, by_cells.status().message() +
                              "; closures that only bind landmarks were followed near the start, and not beyond");
  }

  Result<RouteAnswer> as_answer(Result<Route> route) {
    if (!route.ok()) return route.status();
    answer_.route = std::move(route).value();
    return std::move(answer_);
  }

  const RouteIndex::Snapshot& map_;
  const std::span<const FrameId> from_, to_;
  const RouteOptions& options_;
  const WorkLimit& work_;
  RouteAnswer answer_;
};

}  // namespace

Result<RouteAnswer> search_route(const RouteIndex::Snapshot& map, std::span<const FrameId> from,
                                 std::span<const FrameId> to, const RouteOptions& options, std::uint64_t near_steps,
                                 const WorkLimit& work) {
  return RouteSearch(map, from, to, options, work).answer(near_steps);
}

std::vector<Alternative> search_alternatives(const RouteIndex::Snapshot& map, std::span<const FrameId> from,
                                             std::span<const FrameId> to, const RouteOptions& options,
                                             std::uint64_t near_steps, const RouteAnswer& cheapest, std::size_t count,
                                             const WorkLimit& work) {
  const AlternativesQuery asked{from, to, options.weights, options.max_cost, count};
  if (cheapest.near || !cheapest.frame_by_frame.empty()) {
    RouteOptions each = options;
    each.max_cost = std::numeric_limits<double>::infinity();  // which counts without the penalty
    // Within kMaxStretch times the cost of a route lie some kMaxStretch^2 times as many frames as within its own.
    const std::size_t around = cheapest.near ? 4 * kNearFramesAStep * near_steps : work.max_frames;
    return find_alternatives(
        *map.view, cheapest.route, asked,
        [&](std::span<const FrameId> starts, std::span<const FrameId> goals, const Penalty& penalty,
            const WorkLimit& rest) {
          WorkLimit limit = rest;
          limit.max_frames = std::min(limit.max_frames, around);
          each.penalty = penalty;
          return find_route(*map.view, starts, goals, each, limit);
        },
        work);
  }
  auto query = as_cells_have_it(map, options);
  if (!query.ok()) return {};
  query->max_cost = std::numeric_limits<double>::infinity();
  return find_alternatives(
      *map.view, cheapest.route, asked,
      [&](std::span<const FrameId> starts, std::span<const FrameId> goals, const Penalty& penalty,
          const WorkLimit& rest) {
        query->penalty = penalty;
        return route_by_cells(map, *query, starts, goals, options.count_standing, rest);
      },
      work);
}

}  // namespace relmap::route
