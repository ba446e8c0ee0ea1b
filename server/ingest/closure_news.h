// What the robot that saw the newer end of a closure is told of it.
#pragma once

#include <optional>

#include "proto/ingest_messages.h"
#include "storage/graph.h"

namespace relmap {

// `closure` as Mapper's watcher gets it. Nothing for a place without a transform (verified by appearance alone).
std::optional<PoseNews> closure_news(const Graph& map, const Edge& closure);

}  // namespace relmap
