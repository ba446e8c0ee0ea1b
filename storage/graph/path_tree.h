// Breadth-first search from a frame over accepted edges: neighbours in increasing order of edge id, and the first
// discovery wins. It finds what lies around a place, also by the newest paths. (The paths of observations are
// LocalGraph's.)
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "proto/geometry/geometry.h"
#include "storage/graph/graph.h"

namespace relmap::storage {

inline constexpr std::uint32_t kTreeFrames = 1000;  // frames of a tree at most

struct PathLimits {
  std::uint32_t depth = 30;  // edges
  std::uint32_t frames = kTreeFrames;
  FrameId until = {};  // if valid: the search stops when it finds this frame; the tree up to it is the same
};

struct PathNode {
  FrameId frame;
  std::int32_t parent = -1;  // index of the node nearer to the root; -1: the root
  EdgeId edge;               // between the parent and this frame
  bool forward = false;      // from the parent, the edge is walked a -> b
  std::uint32_t depth = 0;
};

// Nodes in the order of discovery: nodes[0] is the root, parents before children.
struct PathTree {
  std::vector<PathNode> nodes;
  std::unordered_map<FrameId, std::uint32_t> index;  // frame -> node
  bool cut = false;                                  // the limits left frames out

  const PathNode* find(FrameId frame) const {
    const auto it = index.find(frame);
    return it == index.end() ? nullptr : &nodes[it->second];
  }
};

PathTree build_path_tree(const Graph& graph, FrameId root, PathLimits limits = {});

// T_root_node of every node, compounded along the tree from the edges' estimates.
std::vector<SE3> poses_along(const Graph& graph, const PathTree& tree);

}  // namespace relmap::storage
