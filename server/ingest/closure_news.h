// What the robot that saw the newer end of a closure is told of it.
#pragma once

#include <optional>

#include "proto/keyframe/ingest_messages.h"
#include "storage/graph/graph.h"

namespace relmap::ingest {

// `closure` as Mapper's watcher gets it. Nothing for a place without a transform (verified by appearance alone).
std::optional<PoseNews> closure_news(const storage::Graph& map, const storage::Edge& closure);

}  // namespace relmap::ingest
