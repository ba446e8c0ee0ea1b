// A breadth-first search over accepted edges that its caller can end. Neighbours are visited in order of edge id and
// the first discovery of a frame wins, so it finds the same paths as build_path_tree(). It is bounded by the visitor
// and a WorkLimit instead of a depth.
#pragma once

#include <functional>

#include "server/route/work_limit.h"
#include "storage/graph/path_tree.h"

namespace relmap::route {

enum class Visit : std::uint8_t { kExpand, kLeaf, kDrop, kStop };

// Called for each newly discovered node except the root, with the edge from its parent. kExpand keeps the node and
// continues from it, kLeaf keeps it without continuing from it, kDrop ignores it (another edge may discover it again),
// and kStop keeps it and ends the search.
using Visitor =
    std::function<Visit(const storage::PathTree& tree, const storage::PathNode& node, const storage::Edge& edge)>;

// Returns the tree that was found; its `cut` is set if work.max_frames ended the search. NO_SUCH_FRAME, and what
// work.proceed returns.
Result<storage::PathTree> search_breadth_first(const storage::Graph& graph, FrameId root, const WorkLimit& work,
                                               const Visitor& visit);

}  // namespace relmap::route
