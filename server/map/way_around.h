// Finds the way around a stop. After a stop, a robot may be recognised in frames of other sessions only. Then no
// closure measures its own motion, but the map does: from a frame before the stop a way leads over what others drove to
// the recognised place. Whether this and the robot's odometry agree tells whether the robot was carried
// (docs/method.md, 7).
#pragma once

#include <functional>
#include <memory>

#include "server/route/overlay/route_index.h"
#include "server/route/weight.h"
#include "storage/graph/graph.h"
#include "storage/journal/journal_record.h"

namespace relmap::map {

// Returns the newest view of the map, and cells that a search passes instead of frame after frame. Thread-safe.
using RouteMap = std::function<route::RouteIndex::Snapshot()>;

// By these weights a way without stops is preferred to one that is shorter by up to 1,000 m for each second of
// standing.
inline constexpr route::RouteWeights kWithoutStops{.standing_second = 1000};

// Finds the way for a proposal; null if
//   - the proposal is with its session's own past, at most kMotionReach keyframes back, which tells the same;
//   - in the kMotionReach keyframes before its query the robot did not stand still for kMinRideSeconds, or only where
//     closures in force tell its motion, or there is motion that nothing sensed, or no frame before that stop is joined
//     to another session by a closure in force;
//   - a frame between the stop and the query is joined to another session already, so that a way was sought before,
//     and it is not the turn of this query: those whose index is a multiple of 16 seek again, since the map may have
//     got a way in the meantime, and so do those that follow one that found a way;
//   - the map has no way from that frame to the match, or both the shortest way and the one with the least standing
//     lead through such a stop themselves, along a carried stretch, over motion that was not measured or through a
//     deleted session, so that they tell nothing.
// The stop is sought in `graph`. The way is sought in the newest map if `newest` is given, by its cells for distance
// and kWithoutStops; without them, frame by frame through at most 2^17 frames. Where the map is damaged, the result is
// null. Throws StatusError VIEW_EXPIRED.
std::shared_ptr<const storage::WayAround> way_around(const storage::Graph& graph,
                                                     const storage::ClosureProposalRecord& proposal,
                                                     const RouteMap& newest = {});

}  // namespace relmap::map
