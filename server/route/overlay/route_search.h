// The route from one set of frames to another: by cells where they have what is asked for, frame by frame where not.
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
  std::string frame_by_frame;    // why cells did not find it; empty: they did
  bool near = false;             // it was found around the start, where closures that only bind landmarks are followed
  bool no_way_by_edges = false;  // near, and the edges of the graph alone do not lead there
};

// Frames that the search around the start may touch, for each of its steps: in a street that is passed ten times nearly
// all are found so (docs/decisions/routes.md).
inline constexpr std::uint64_t kNearFramesAStep = 40;

// The best route from any of `from` to any of `to`. A route by cells of at most `near_steps` steps, and one that cells
// do not find, is searched again around the start, with closures that only bind landmarks; 0: never. Each search of the
// several that this may take keeps to `work`.
//
// NOT_CONNECTED, COST_LIMIT, OUT_OF_REACH, what `work.proceed` says, and DATA_LOSS or IO_ERROR where the map cannot be
// read. Thread-safe.
Result<RouteAnswer> search_route(const RouteIndex::Snapshot& map, std::span<const FrameId> from,
                                 std::span<const FrameId> to, const RouteOptions& options, std::uint64_t near_steps,
                                 const WorkLimit& work);

}  // namespace relmap::route
