// All edges and closures of the map, or those that a caller wants, in increasing id.
#pragma once

#include <functional>
#include <optional>
#include <set>

#include "server/route/work_limit.h"
#include "storage/graph/graph.h"

namespace relmap::rpc {

struct EdgeFilter {
  std::set<storage::EdgeState> states;   // empty: all
  std::set<storage::EdgeKind> kinds;     // empty: all
  std::optional<SessionNumber> session;  // with an end in it
  std::optional<FrameId> frame;          // with it as an end

  bool matches(const storage::Edge& edge) const {
    return (states.empty() || states.contains(edge.state)) && (kinds.empty() || kinds.contains(edge.kind)) &&
           (!session || edge.a.session == *session || edge.b.session == *session) &&
           (!frame || edge.a == *frame || edge.b == *frame);
  }
};

// Calls `visit` with the edges that match and are greater than `after`, ascending, until it returns false. `after`, if
// valid, is an edge of the map. DATA_LOSS, and what work.proceed says.
Status for_each_edge(const storage::Graph& graph, const EdgeFilter& filter, EdgeId after, const route::WorkLimit& work,
                     const std::function<bool(const storage::Edge&)>& visit);

}  // namespace relmap::rpc
