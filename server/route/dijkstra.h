// Shortest routes over the paged graph (Dijkstra 1959). There is no admissible straight-line heuristic: a relative map
// has no global embedding.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "server/route/carried.h"
#include "server/route/passage.h"
#include "server/route/trail.h"
#include "server/route/unmeasured.h"
#include "server/route/weight.h"
#include "server/route/work_limit.h"
#include "storage/graph/compounded_chain.h"
#include "storage/graph/graph.h"

namespace relmap::route {

struct RouteOptions {
  RouteWeights weights = {};
  double max_cost = std::numeric_limits<double>::infinity();  // as `weights` have it
  RouteFilter filter = {};
  bool count_standing = false;  // in Route::time_s, even where it has no weight
};

struct RouteStep {
  FrameId frame;
  double distance_m = 0;            // from the start of the route to this frame
  double time_s = 0;                // with what was stood, if that counted
  std::vector<std::string> labels;  // of this frame

  // The edge to the next step; invalid at the last.
  EdgeId edge;
  storage::EdgeKind kind = storage::EdgeKind::kOdometry;
  SE3 T_to_next;  // T_this_next
  // Where they are compounded: from the route's first frame to this one.
  SE3 T_start_this;
  Matrix6 covariance = Matrix6::Zero();  // of T_start_this Exp(xi)
  bool long_loop = false;                // passable only by assumption: a loop edge longer than kLongLoopMetres
  bool carried = false;                  // the robot was carried along the edge
  bool unmeasured = false;               // nothing measured the edge (is_unmeasured())
};

// Found, and to be walked: RouteWalk reads the steps from the graph, one after another, so a route of a million frames
// holds two bytes for each.
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
  // An edge of the path, and what it costs: one after the other.
  void count(const storage::Edge& edge, double edge_cost) {
    long_loops += is_long_loop(edge);
    carried.add(edge);
    unmeasured.add(edge);
    cost += edge_cost;
    distance_m += length_m(edge);
    time_s += relmap::route::time_s(edge, count_standing);
  }
};

class RouteWalk {
 public:
  // Both must outlive it.
  RouteWalk(const storage::Graph& graph, const Route& route, bool compound = false)
      : walk_(graph, route.path), standing_(route.count_standing), compound_(compound) {}

  // nullopt after the last. Throws StatusError where reads of the graph do.
  std::optional<RouteStep> next();

 private:
  PathWalk walk_;
  const bool standing_, compound_;
  storage::CompoundedChain chain_;
  double distance_m_ = 0, time_s_ = 0;
};

// The cheapest route from any of `from` to any of `to` over edges that are open (passage.h). Of equally cheap routes
// always the same one is given.
//
// INVALID_ARGUMENT (an end without frames, weights that are none), NO_SUCH_FRAME, NOT_CONNECTED (all that can be
// reached was searched; the message names the sessions on both sides, and whether directions or the filter were in the
// way), COST_LIMIT, OUT_OF_REACH, and what work.proceed says. Throws StatusError where reads of the graph do.
Result<Route> find_route(const storage::Graph& graph, std::span<const FrameId> from, std::span<const FrameId> to,
                         const RouteOptions& options = {}, const WorkLimit& work = {});

}  // namespace relmap::route
