// A bounded search: breadth-first over accepted edges, neighbours in increasing edge id, the first discovery wins. It
// finds the paths of build_path_tree(), but stops when the caller has seen enough, and answers to a WorkLimit instead
// of a depth.
#pragma once

#include <functional>

#include "server/route/work_limit.h"
#include "storage/graph/path_tree.h"

namespace relmap::route {

enum class Visit : std::uint8_t { kExpand, kLeaf, kDrop, kStop };

// Called for each newly discovered node but the root with the edge from its parent. kLeaf: keep it, but do not go on
// from it. kDrop: as if it were not there (it may be discovered again by another edge). kStop: keep it, and end.
using Visitor =
    std::function<Visit(const storage::PathTree& tree, const storage::PathNode& node, const storage::Edge& edge)>;

// The tree so far; `cut` if work.max_frames ended it. NO_SUCH_FRAME, or what work.proceed says.
Result<storage::PathTree> search_breadth_first(const storage::Graph& graph, FrameId root, const WorkLimit& work,
                                               const Visitor& visit);

}  // namespace relmap::route
