// Shortest routes over the paged graph (Dijkstra 1959). There is no admissible straight-line heuristic, since a
// relative map has no global embedding.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "server/route/passage.h"
#include "server/route/penalty.h"
#include "server/route/stretches.h"
#include "server/route/trail.h"
#include "server/route/weight.h"
#include "server/route/work_limit.h"
#include "storage/graph/compounded_chain.h"
#include "storage/graph/graph.h"

namespace relmap::route {

struct RouteOptions {
  RouteWeights weights = {};
  double max_cost = std::numeric_limits<double>::infinity();  // in the unit that `weights` define
  RouteFilter filter = {};
  bool count_standing = false;  // count standing times in Route::time_s even if they have no weight
  Penalty penalty = {};         // the search and max_cost include it, the figures of the route do not
};

struct RouteStep {
  FrameId frame;
  double distance_m = 0;            // from the start of the route to this frame
  double time_s = 0;                // from the start; with standing times if they count
  std::vector<std::string> labels;  // of this frame

  // The edge to the next step; invalid at the last.
  EdgeId edge;
  storage::EdgeKind kind = storage::EdgeKind::kOdometry;
  SE3 T_to_next;  // T_this_next
  // From the route's first frame to this one; set only if RouteWalk compounds transforms.
  SE3 T_start_this;
  Matrix6 covariance = Matrix6::Zero();  // of T_start_this Exp(xi)
  bool long_loop = false;                // a loop edge longer than kLongLoopMetres, which may not be passable
  bool carried = false;                  // the robot was carried along the edge
  bool unmeasured = false;               // nothing measured the edge (is_unmeasured())
};

// A route that was found. It holds two bytes a step; RouteWalk reads the steps themselves from the graph, one after
// another.
struct Route {
  Path path;
  double cost = 0;
  double distance_m = 0;
  double time_s = 0;
  std::uint32_t long_loops = 0;
  CarriedStretches carried;
  UnmeasuredStretches unmeasured;
  std::size_t frames_touched = 0;
  bool count_standing = false;

  std::size_t steps() const { return path.turns.size() + 1; }
  // Adds an edge of the path to the totals. The edges must be added in order, from either end.
  void count(const storage::Edge& edge, double edge_cost) {
    long_loops += is_long_loop(edge);
    carried.add(edge);
    unmeasured.add(edge);
    cost += edge_cost;
    distance_m += length_m(edge);
    time_s += relmap::route::time_s(edge, count_standing);
  }
};

// Walks a route from its start.
class RouteWalk {
 public:
  // Graph and route must outlive the walk. `compound` sets RouteStep::T_start_this and its covariance.
  RouteWalk(const storage::Graph& graph, const Route& route, bool compound = false)
      : walk_(graph, route.path), standing_(route.count_standing), compound_(compound) {}

  // The next step; nullopt after the last. Throws StatusError where reads of the graph do.
  std::optional<RouteStep> next();

 private:
  PathWalk walk_;
  const bool standing_, compound_;
  storage::CompoundedChain chain_;
  double distance_m_ = 0, time_s_ = 0;
};

// Returns the cheapest route from any of `from` to any of `to` over edges that are open (passage.h). Which of several
// equally cheap routes it returns is deterministic.
//
// INVALID_ARGUMENT (an end without frames, invalid weights), NO_SUCH_FRAME, NOT_CONNECTED (everything that can be
// reached was searched; the message names the sessions on both sides, and says whether one-way sessions or the filter
// closed edges), COST_LIMIT, OUT_OF_REACH, and what work.proceed returns. Throws StatusError where reads of the graph
// do.
Result<Route> find_route(const storage::Graph& graph, std::span<const FrameId> from, std::span<const FrameId> to,
                         const RouteOptions& options = {}, const WorkLimit& work = {});

}  // namespace relmap::route
