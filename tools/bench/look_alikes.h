// False loops as look-alikes make them: not one by one, but along whole stretches, in which they agree with each other.
#pragma once

#include <cstdint>
#include <vector>

#include "tools/g2o/pose_graph.h"

namespace relmap::bench {

// So many stretches of false loops: each of up to 12 places along the way that look like as many along another part of
// it, as far as both go the same way. Each is as exact as a true one would be. In the order of the stretches.
std::vector<g2o::PoseGraph::Edge> look_alikes(const g2o::PoseGraph& graph, std::uint32_t stretches, std::uint64_t seed);

}  // namespace relmap::bench
