// Finds a route with the cells if they suit the question, and frame by frame if not.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "proto/base/status.h"
#include "server/route/alternatives.h"
#include "server/route/dijkstra.h"
#include "server/route/overlay/route_index.h"
#include "server/route/work_limit.h"

namespace relmap::route {

// A route, and how it was found.
struct RouteAnswer {
  Route route;
  std::string frame_by_frame;    // why cells were not used; empty if they were
  bool near = false;             // found by the search around the start, which also follows closures that only bind
  bool no_way_by_edges = false;  // `near`, and edges of the graph alone do not lead to the goal
};

// The search around the start may touch kNearFramesAStep * near_steps frames, which finds nearly all short routes in a
// street that is passed ten times (docs/decisions/routes.md).
inline constexpr std::uint64_t kNearFramesAStep = 40;

// Returns the best route from any of `from` to any of `to`. If cells give a route of at most `near_steps` steps, or
// none, searches again around the start, where it also follows closures that only bind landmarks. Each of these
// searches keeps to `work`.
//
// NOT_CONNECTED, COST_LIMIT, OUT_OF_REACH, and what find_route() (dijkstra.h) and `work.proceed` return. Throws
// StatusError where reads of the graph do while it searches frame by frame. Thread-safe.
Result<RouteAnswer> search_route(const RouteIndex::Snapshot& map, std::span<const FrameId> from,
                                 std::span<const FrameId> to, const RouteOptions& options, std::uint64_t near_steps,
                                 const WorkLimit& work);

// Returns at most `count` alternatives (alternatives.h) to the route with which search_route() answered on the same
// map. They are found in the same way: by cells, frame by frame, or around the start. What ends the searches, be it
// `work` or what cannot be read, leaves fewer of them. Thread-safe.
std::vector<Alternative> search_alternatives(const RouteIndex::Snapshot& map, std::span<const FrameId> from,
                                             std::span<const FrameId> to, const RouteOptions& options,
                                             std::uint64_t near_steps, const RouteAnswer& cheapest, std::size_t count,
                                             const WorkLimit& work);

}  // namespace relmap::route
