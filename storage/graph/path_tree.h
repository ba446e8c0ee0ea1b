// Breadth-first from a frame over accepted edges, neighbours in increasing edge id, the first discovery wins: what lies
// round a place, by the newest ways too. (The paths of observations are LocalGraph's.)
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "proto/geometry/geometry.h"
#include "storage/graph/graph.h"

namespace relmap::storage {

inline constexpr std::uint32_t kTreeFrames = 1000;  // first frames found

struct PathLimits {
  std::uint32_t depth = 30;  // edges
  std::uint32_t frames = kTreeFrames;
  FrameId until = {};  // if valid: stop as soon as this frame is found; the tree to it is the same
};

struct PathNode {
  FrameId frame;
  std::int32_t parent = -1;  // index of the node nearer to the root; -1: the root
  EdgeId edge;               // between parent and this
  bool forward = false;      // from the parent, the edge is walked a -> b
  std::uint32_t depth = 0;
};

// Nodes in the order of discovery: nodes[0] is the root, parents before children.
struct PathTree {
  std::vector<PathNode> nodes;
  std::unordered_map<FrameId, std::uint32_t> index;  // frame -> node
  bool cut = false;                                  // there was more beyond the limits

  const PathNode* find(FrameId frame) const {
    const auto it = index.find(frame);
    return it == index.end() ? nullptr : &nodes[it->second];
  }
};

PathTree build_path_tree(const Graph& graph, FrameId root, PathLimits limits = {});

// T_root_node for every node, composed along the tree with the edges' estimates.
std::vector<SE3> poses_along(const Graph& graph, const PathTree& tree);

}  // namespace relmap::storage
