// Extracts the part of the map around a frame, in that frame's coordinates.
#pragma once

#include <limits>
#include <vector>

#include "server/route/work_limit.h"
#include "storage/graph/graph.h"

namespace relmap::route {

struct NeighbourhoodLimits {
  std::uint32_t edges = 30;                                 // depth
  double metres = std::numeric_limits<double>::infinity();  // along the path from the root
};

struct NeighbourhoodFrame {
  FrameId frame;
  SE3 T_root_frame;
  std::uint32_t depth = 0;             // edges from the root
  double distance_m = 0;               // along the path from the root
  std::uint32_t unmeasured_steps = 0;  // unmeasured edges on the path (is_unmeasured()); with any, the pose is a guess
};

struct Neighbourhood {
  std::vector<NeighbourhoodFrame> frames;  // in the order of discovery, the root first
  std::vector<EdgeId> edges;               // edges of the graph with both ends inside, ascending
  bool cut = false;                        // whether work.max_frames left frames out
};

// Returns the frames and edges within `limits` of `root`, breadth-first. NO_SUCH_FRAME, and what work.proceed returns.
// Throws StatusError where reads of the graph do.
Result<Neighbourhood> neighbourhood(const storage::Graph& graph, FrameId root, const NeighbourhoodLimits& limits,
                                    const WorkLimit& work);

}  // namespace relmap::route
