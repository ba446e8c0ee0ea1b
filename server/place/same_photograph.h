// Recognises photographs that were added to the map twice: two mono sessions of the same pictures, which no edges join.
#pragma once

#include <span>

#include "storage/graph/frame_range.h"
#include "storage/graph/graph.h"

namespace relmap::place {

// Whether two frames of different mono sessions are of one picture, that is, have the same features. Their indices may
// differ, since photographs may have been added to the folder between the two imports.
bool same_photograph(const storage::Graph& graph, FrameId a, FrameId b);

// Whether any frame in these ranges is of the same photograph as `frame`.
bool has_photograph(const storage::Graph& graph, std::span<const storage::FrameRange> frames, FrameId frame);

}  // namespace relmap::place
