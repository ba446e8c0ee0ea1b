// Which frames show the same place: those a few steps away in the graph.
#pragma once

#include <cstdint>
#include <vector>

#include "storage/graph.h"

namespace relmap {

inline constexpr std::uint32_t kPlaceRadius = 5;  // edges

// Frames within `radius` steps of `centre`, itself first, in the order of discovery. A step is an accepted edge; in a
// mono session, which has no edges, it is the next or the previous frame.
std::vector<FrameId> place_neighbours(const Graph& graph, FrameId centre, std::uint32_t radius);

}  // namespace relmap
