// News of a closure for the robot whose keyframe is its newer end.
#pragma once

#include <optional>

#include "proto/keyframe/ingest_messages.h"
#include "storage/graph/graph.h"

namespace relmap::ingest {

// `map` and `closure` are as passed to Mapper's watcher. Nullopt if the closure has no transform in metres.
std::optional<PoseNews> closure_news(const storage::Graph& map, const storage::Edge& closure);

}  // namespace relmap::ingest
