// Why there is no route: the same words from every search.
#pragma once

#include <set>
#include <span>
#include <string>

#include "proto/base/status.h"
#include "server/route/weight.h"
#include "storage/graph/graph.h"

namespace relmap::route {

// INVALID_ARGUMENT: weights that are none, an end without frames.
Status check_weights(const RouteWeights& weights);
Status check_ends(std::span<const FrameId> from, std::span<const FrameId> to);

// NO_SUCH_FRAME
Status no_such_frame(FrameId frame);
// NOT_CONNECTED: the filter refuses all frames of an end.
Status end_refused(bool start);
// COST_LIMIT
Status beyond(double max_cost, const RouteWeights& weights);
// NOT_CONNECTED. Sessions that can be reached, and those of the goal; what else was in the way.
Status not_connected(const storage::Graph& graph, const std::set<SessionNumber>& reached, std::span<const FrameId> to,
                     bool oneway, bool filter);

}  // namespace relmap::route
