// How well the position of frames relative to one of them is known, for pictures and reports.
#pragma once

#include <vector>

#include "client/relaxation.h"

namespace relmap::client {

// For each frame the standard deviation (root of the trace, metres) of its position relative to `root`, along the most
// certain path that a search from the root finds: covariances of edges are compounded as if they were independent, with
// what rotations add over the distance. That is an upper bound for a map in which several paths join two frames.
// Infinite for a frame that no edge connects with the root. `edges` as for relax(); their ends must be in `frames`,
// others are left out.
std::vector<double> position_sigmas(const std::vector<FrameId>& frames, const std::vector<RelaxationEdge>& edges,
                                    FrameId root);

}  // namespace relmap::client
