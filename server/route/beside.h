// Finds what lies beside a route: in a street that was driven several times, each pass has frames of its own, and two
// routes by different passes are the same way for whoever drives it.
#pragma once

#include <span>

#include "proto/base/status.h"
#include "server/route/work_limit.h"
#include "storage/graph/frame_set.h"
#include "storage/graph/graph.h"

namespace relmap::route {

// Returns `frames` and all frames that edges and closures in force, also those that only bind landmarks, join to one of
// them over at most `metres`. Directions and filters are ignored. OUT_OF_REACH beyond work.max_frames, and what
// work.proceed returns. Throws StatusError where reads of the graph do.
Result<storage::FrameSet> frames_beside(const storage::Graph& graph, std::span<const FrameId> frames, double metres,
                                        const WorkLimit& work);

}  // namespace relmap::route
