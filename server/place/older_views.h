// Finds the older passes of a place. Where a place has been passed many times, a closure is made with the oldest pass
// that saw it, so that every later pass is one loop edge away from the frames in which the place's landmarks are based,
// however many passes have come between (docs/method.md, 2).
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "proto/geometry/geometry.h"
#include "storage/graph/graph.h"

namespace relmap::place {

// Frames that are further apart than this (metres, radians) are not taken to share landmarks.
inline constexpr double kMaxViewDistance = 4.0;
inline constexpr double kMaxViewAngle = 0.8;

struct OlderView {
  FrameId frame;
  SE3 T_frame_query;  // compounded along the map's edges
};

// For a query that was found at `T_match_query` from `match`, returns the nearest frame of each older pass that can be
// reached from `match` by walking up loop edges (storage/graph/local_graph.h), if it is near enough to share landmarks
// with the query. The oldest pass comes first; at most kMaxOlderViews are returned, all of them added to the map before
// `match`. Frames for which `left_out(frame)` is true, such as the query's own recent past, are skipped. The caller
// must verify that the frames do share enough landmarks.
inline constexpr std::size_t kMaxOlderViews = 3;
std::vector<OlderView> older_views(const storage::Graph& graph, FrameId match, const SE3& T_match_query,
                                   const std::function<bool(FrameId)>& left_out);

}  // namespace relmap::place
