// Decides which frames and edges a route may use.
#pragma once

#include <cstdint>
#include <set>
#include <unordered_map>
#include <unordered_set>

#include "server/route/weight.h"
#include "storage/graph/graph.h"

namespace relmap::route {

// What a route may use. By default these are all frames, and all edges of the graph.
struct RouteFilter {
  std::set<SessionNumber> sessions;     // sessions whose frames may be passed; empty means all
  std::unordered_set<FrameId> avoided;  // frames that may not be passed
  std::uint32_t min_support = 0;        // minimum support of an edge in force, in observations
  bool long_loops = true;               // whether loop edges longer than kLongLoopMetres may be used
  bool against_oneway = false;          // one-way sessions are open in both directions: nobody is going to drive there
  storage::Supposed supposed;           // closures that are taken to be edges, too

  bool refuses_nothing() const {
    return sessions.empty() && avoided.empty() && min_support == 0 && long_loops && !against_oneway;
  }
  bool passes(FrameId frame) const {
    return (sessions.empty() || sessions.contains(frame.session)) && !avoided.contains(frame);
  }
  bool passes(const storage::Edge& edge) const {
    return (edge.support >= min_support || edge.state != storage::EdgeState::kAccepted) &&
           (long_loops || !is_long_loop(edge));
  }
};

// Tells one search which frames and edges are open. Odometry and prior edges of a `oneway` session are open only in the
// direction in which they were driven, a -> b; loop edges, which nobody drove, are open in both directions.
class Passage {
 public:
  Passage(const storage::Graph& graph, const RouteFilter& filter) : graph_(graph), filter_(filter) {}

  bool open(FrameId frame);
  // Whether the edge may be travelled from Edge::a to Edge::b (forward) or back, which includes the frame at its end.
  // The edge must be in the graph or supposed to be.
  bool open(const storage::Edge& edge, bool forward);

  // Whether anything has been refused so far because of its direction, or by the filter.
  bool met_oneway() const { return met_oneway_; }
  bool met_filter() const { return met_filter_; }

 private:
  bool is_oneway(SessionNumber session);

  const storage::Graph& graph_;
  const RouteFilter& filter_;
  std::unordered_map<SessionNumber, bool> oneway_;
  bool met_oneway_ = false, met_filter_ = false;
};

}  // namespace relmap::route
