// Transforms between frames of a map: by the relative map, and by a pose graph in one global frame.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "storage/graph/graph.h"

namespace relmap::bench {

using Transform = std::function<std::optional<SE3>(FrameId from, FrameId to)>;  // nullopt: not connected

// The graph must outlive it.
Transform relative_map(const storage::Graph& graph);

// A pose graph of the map's edges between these frames, with closures as they were measured, relaxed in one global
// frame. `loop_huber`: as in RelaxationOptions. Throws StatusError.
Transform pose_graph(const storage::Graph& graph, const std::vector<FrameId>& frames, double loop_huber);

}  // namespace relmap::bench
