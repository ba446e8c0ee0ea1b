// Where the map is no longer what an overlay was made of.
#pragma once

#include <span>
#include <unordered_map>

#include "server/route/overlay/overlay.h"
#include "server/route/work_limit.h"

namespace relmap::route {

// The frames of chunks that changed, or came, since the overlay was made; and of those to which their edges lead, where
// these changed, since what is stored with one end concerns both. What the overlay says of all other chunks is true.
// Throws StatusError where reads of the graph do, and what work.proceed says.
std::unordered_map<storage::ChunkId, CellFrames> frames_of_stale(const Overlay& overlay, const storage::Graph& graph,
                                                                 std::span<const storage::ChunkId> changed,
                                                                 const WorkLimit& work = {});

}  // namespace relmap::route
