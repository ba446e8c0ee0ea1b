// Finds a route with the cells made beforehand where they fit the question, and frame by frame where not.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "proto/base/status.h"
#include "server/route/dijkstra.h"
#include "server/route/overlay/route_index.h"
#include "server/route/work_limit.h"

namespace relmap::route {

// A route, and how it was found.
struct RouteAnswer {
  Route route;
  std::string frame_by_frame;    // why cells were not used; empty: they were
  bool near = false;             // it was found around the start, where closures that only bind landmarks are followed
  bool no_way_by_edges = false;  // near, and the edges of the graph alone do not lead there
};

// The search around the start may touch kNearFramesAStep * near_steps frames: in a street that is passed ten times
// nearly all are found so (docs/decisions/routes.md).
inline constexpr std::uint64_t kNearFramesAStep = 40;

// The best route from any of `from` to any of `to`. Where cells give a route of at most `near_steps` steps, or none, it
// is searched again around the start, where closures that only bind landmarks are followed too. Each search of the
// several that this may take keeps to `work`.
//
// NOT_CONNECTED, COST_LIMIT, OUT_OF_REACH, and what find_route() (dijkstra.h) and `work.proceed` say. Throws
// StatusError where reads of the graph do, while it searches frame by frame. Thread-safe.
Result<RouteAnswer> search_route(const RouteIndex::Snapshot& map, std::span<const FrameId> from,
                                 std::span<const FrameId> to, const RouteOptions& options, std::uint64_t near_steps,
                                 const WorkLimit& work);

}  // namespace relmap::route
