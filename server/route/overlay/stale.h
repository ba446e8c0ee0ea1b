// Finds where the map is no longer as it was when an overlay was made.
#pragma once

#include <span>
#include <unordered_map>

#include "server/route/overlay/overlay.h"
#include "server/route/work_limit.h"

namespace relmap::route {

// Returns the frames of the chunks that changed or came since the overlay was made, and of chunks to which their
// changed edges lead, since an edge is stored with one end but concerns both. The overlay is right about all other
// chunks. Throws StatusError where reads of the graph do, and with what work.proceed returns.
std::unordered_map<storage::ChunkId, CellFrames> frames_of_stale(const Overlay& overlay, const storage::Graph& graph,
                                                                 std::span<const storage::ChunkId> changed,
                                                                 const WorkLimit& work = {});

}  // namespace relmap::route
