// Which frames and edges a route may use.
#pragma once

#include <cstdint>
#include <set>
#include <unordered_map>
#include <unordered_set>

#include "server/route/weight.h"
#include "storage/graph/graph.h"

namespace relmap::route {

// By default: all frames, and all edges of the graph.
struct RouteFilter {
  std::set<SessionNumber> sessions;  // whose frames may be passed; empty: all
  std::unordered_set<FrameId> avoided;
  std::uint32_t min_support = 0;  // of an edge in force: observations that use it
  bool long_loops = true;         // loop edges longer than kLongLoopMetres, too
  storage::Supposed supposed;

  bool refuses_nothing() const { return sessions.empty() && avoided.empty() && min_support == 0 && long_loops; }
  bool passes(FrameId frame) const {
    return (sessions.empty() || sessions.contains(frame.session)) && !avoided.contains(frame);
  }
  bool passes(const storage::Edge& edge) const {
    return (edge.support >= min_support || edge.state != storage::EdgeState::kAccepted) &&
           (long_loops || !is_long_loop(edge));
  }
};

// Whether an edge may be travelled, asked in the course of one search. Odometry and prior edges of a `oneway` session
// are travelled only as driven, a -> b; loop edges, which nobody drove, both ways.
class Passage {
 public:
  Passage(const storage::Graph& graph, const RouteFilter& filter) : graph_(graph), filter_(filter) {}

  bool open(FrameId frame);
  // From Edge::a to Edge::b (forward), or back; the edge is one of the graph, or supposed to be.
  bool open(const storage::Edge& edge, bool forward);

  // So far something was refused for its direction, or by the filter.
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
