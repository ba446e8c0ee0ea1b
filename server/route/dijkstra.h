// Shortest routes over the paged graph (Dijkstra 1959). There is no admissible straight-line heuristic: a relative map
// has no global embedding.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "server/route/weight.h"
#include "server/route/work_limit.h"
#include "storage/graph.h"

namespace relmap {

struct RouteOptions {
  RouteBy by = RouteBy::kDistance;
  bool count_standing = false;                                // by time: add the time stood on the way
  double max_cost = std::numeric_limits<double>::infinity();  // metres or seconds
};

struct RouteStep {
  FrameId frame;
  double distance_m = 0;  // from the start of the route to this frame
  double time_s = 0;
  std::vector<std::string> labels;  // of this frame

  // The edge to the next step; invalid at the last.
  EdgeId edge;
  EdgeKind kind = EdgeKind::kOdometry;
  SE3 T_to_next;           // T_this_next
  bool long_loop = false;  // passable only by assumption: a loop edge longer than kLongLoopMetres
};

struct Route {
  std::vector<RouteStep> steps;  // at least one; first and last are of `from` and `to`
  double distance_m = 0;
  double time_s = 0;
  std::uint32_t long_loops = 0;
  std::size_t frames_touched = 0;
};

// The cheapest route from any of `from` to any of `to` over accepted edges that carry. Odometry and prior edges of a
// `oneway` session are travelled only as driven, a -> b; loop edges, which nobody drove, both ways. Of equally cheap
// routes always the same one is given.
//
// INVALID_ARGUMENT (an end without frames), NO_SUCH_FRAME, NOT_CONNECTED (all that can be reached was searched; the
// message names the sessions on both sides), COST_LIMIT, OUT_OF_REACH, and what work.proceed says. Throws StatusError
// where reads of the graph do.
Result<Route> find_route(const Graph& graph, std::span<const FrameId> from, std::span<const FrameId> to,
                         const RouteOptions& options = {}, const WorkLimit& work = {});

}  // namespace relmap
