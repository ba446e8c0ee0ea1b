// How one frame of a map lies to another: as its relative map says, and as one global frame for all would have it.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "storage/graph/graph.h"

namespace relmap::bench {

using Transform = std::function<std::optional<SE3>(FrameId from, FrameId to)>;  // nothing: no way leads there

// The graph must outlive it.
Transform relative_map(const storage::Graph& graph);

// The map's edges between these frames, closures as they were measured, spread over one global frame. `loop_huber`: as
// in RelaxationOptions. Throws StatusError.
Transform pose_graph(const storage::Graph& graph, const std::vector<FrameId>& frames, double loop_huber);

}  // namespace relmap::bench
