// Messages that say why there is no route, shared by all searches.
#pragma once

#include <set>
#include <span>
#include <string>

#include "proto/base/status.h"
#include "server/route/weight.h"
#include "storage/graph/graph.h"

namespace relmap::route {

// INVALID_ARGUMENT if the weights are invalid or an end has no frames.
Status check_weights(const RouteWeights& weights);
Status check_ends(std::span<const FrameId> from, std::span<const FrameId> to);

// NO_SUCH_FRAME
Status no_such_frame(FrameId frame);
// NOT_CONNECTED, since the filter refuses all frames of the start (or else the goal).
Status end_refused(bool start);
// COST_LIMIT
Status beyond(double max_cost, const RouteWeights& weights);
// NOT_CONNECTED, with the sessions that were reached and those of the goal. `oneway` and `filter` say whether edges
// were left out because of their direction or by the filter.
Status not_connected(const storage::Graph& graph, const std::set<SessionNumber>& reached, std::span<const FrameId> to,
                     bool oneway, bool filter);

}  // namespace relmap::route
