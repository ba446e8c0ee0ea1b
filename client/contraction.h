// Relaxation of a graph of any size: one that is too large to be relaxed whole is relaxed through fewer frames.
//
// Of each stretch of a session's odometry every n-th frame is kept. The steps between two kept frames become one edge.
// Other edges are carried along the odometry to the kept frames before their ends; of several loop edges between the
// same two, the most certain one counts, and one whose ends share their kept frame counts not at all. Frames that were
// not kept follow from those that were, along the odometry; by what the relaxation changed a stretch, each of its steps
// changes in proportion to its variance.
#pragma once

#include <cstddef>
#include <vector>

#include "client/relaxation.h"

namespace relmap::client {

struct ContractedRelaxation {
  Relaxation relaxation;              // poses of all frames given
  std::size_t kept = 0;               // frames that were relaxed
  std::vector<RelaxationEdge> edges;  // those that were relaxed, with their ends among the kept frames
  // For each of these, the index of the edge given that it stands for; for a stretch, that of its least certain step.
  std::vector<std::size_t> stands_for;
};

// Like relax(), but of more than `max_frames` (at least 1) only about so many are relaxed: besides these the first
// frame after each interruption of the odometry, and both ends of a step of which next to nothing is known. Components,
// and their first frames, are those of the frames in ascending order. With fewer frames the result is that of relax().
Result<ContractedRelaxation> relax_contracted(const std::vector<FrameId>& frames,
                                              const std::vector<RelaxationEdge>& edges, std::size_t max_frames,
                                              const RelaxationOptions& options = {});

}  // namespace relmap::client
