// False loops as look-alikes cause them: along whole stretches, in which they agree with each other.
#pragma once

#include <cstdint>
#include <vector>

#include "tools/g2o/pose_graph.h"

namespace relmap::bench {

// Adds `stretches` stretches of false loops. In each, up to 12 places along the drive look like as many along another
// part of it, as long as both go the same way. Each loop is as exact as a true one. Returned in the order of the
// stretches.
std::vector<g2o::PoseGraph::Edge> look_alikes(const g2o::PoseGraph& graph, std::uint32_t stretches, std::uint64_t seed);

}  // namespace relmap::bench
