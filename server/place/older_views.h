// In a place that has been passed many times a closure is made with the oldest pass that saw it: so every later pass is
// one loop edge away from where the place's landmarks are based, however many have come between (docs/method.md, 2).
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "proto/geometry/geometry.h"
#include "storage/graph/graph.h"

namespace relmap::place {

// Of frames that may share landmarks with another: metres and radians between them at most.
inline constexpr double kMaxViewDistance = 4.0;
inline constexpr double kMaxViewAngle = 0.8;

struct OlderView {
  FrameId frame;
  SE3 T_frame_query;  // as the map has it
};

// A query has been found to stand at `T_match_query` from `match`. Of each older pass that leads up from `match` (over
// loop edges, storage/graph/local_graph.h) the frame nearest to the query, if it is near enough to share landmarks with
// it: the oldest pass first, kMaxOlderViews at most, all taken in before `match`. Whether they do share enough is for
// the caller to verify.
inline constexpr std::size_t kMaxOlderViews = 3;
// `left_out(frame)`: not looked at, as what the query has just seen itself.
std::vector<OlderView> older_views(const storage::Graph& graph, FrameId match, const SE3& T_match_query,
                                   const std::function<bool(FrameId)>& left_out);

}  // namespace relmap::place
