// Lists the edges and closures of the map, or those that match a filter, in order of their ids.
#pragma once

#include <functional>
#include <optional>
#include <set>

#include "server/route/work_limit.h"
#include "storage/graph/graph.h"

namespace relmap::route {

struct EdgeFilter {
  std::set<storage::EdgeState> states;   // empty: all
  std::set<storage::EdgeKind> kinds;     // empty: all
  std::optional<SessionNumber> session;  // edges with an end in this session
  std::optional<FrameId> frame;          // edges with this frame as an end
  // With `session`: edges between the two, or within one if they are the same.
  std::optional<SessionNumber> other_session = {};

  bool matches(const storage::Edge& edge) const {
    return (states.empty() || states.contains(edge.state)) && (kinds.empty() || kinds.contains(edge.kind)) &&
           joins(edge.a, edge.b);
  }
  bool joins(FrameId a, FrameId b) const {
    const auto is_between = [&](SessionNumber s, SessionNumber t) { return s == *session && t == *other_session; };
    return (!session || a.session == *session || b.session == *session) &&
           (!session || !other_session || is_between(a.session, b.session) || is_between(b.session, a.session)) &&
           (!frame || a == *frame || b == *frame);
  }
};

// Calls `visit` with the matching edges behind `after`, ascending by id, until it returns false. `after` is an edge of
// the map, or invalid to begin with the first. DATA_LOSS, and what work.proceed returns.
Status for_each_edge(const storage::Graph& graph, const EdgeFilter& filter, EdgeId after, const WorkLimit& work,
                     const std::function<bool(const storage::Edge&)>& visit);

}  // namespace relmap::route
