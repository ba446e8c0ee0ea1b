// A recording of photographs that was taken in twice: two mono sessions of the same pictures, which no metres join.
#pragma once

#include <span>

#include "storage/graph/frame_range.h"
#include "storage/graph/graph.h"

namespace relmap::place {

// Frames of two mono sessions that are of one picture: they have the same features. Their indices may differ, since
// photographs may have been added to the folder before it was taken in again.
bool same_photograph(const storage::Graph& graph, FrameId a, FrameId b);

// Whether one of these frames, a range each, is of the same photograph.
bool has_photograph(const storage::Graph& graph, std::span<const storage::FrameRange> frames, FrameId frame);

}  // namespace relmap::place
