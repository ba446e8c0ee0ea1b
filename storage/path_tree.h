// Path(j, i) of docs/method.md, 2: breadth-first from the base j over accepted edges, neighbours in increasing edge id,
// the first discovery wins. A property of the accepted graph alone.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include "proto/geometry.h"
#include "storage/graph.h"

namespace relmap {

inline constexpr std::uint32_t kPathDepth = 30;     // D: edges
inline constexpr std::uint32_t kPathFrames = 1000;  // first frames found

struct PathLimits {
  std::uint32_t depth = kPathDepth;
  std::uint32_t frames = kPathFrames;
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

// The same tree, grown only as far as it is asked for.
class PathSearch {
 public:
  // `graph` must outlive it.
  PathSearch(const Graph& graph, FrameId root, PathLimits limits = {});

  // Null: `frame` is not in the tree. Good until the next call.
  const PathNode* find(FrameId frame);
  const PathTree& tree() const { return tree_; }
  PathTree take() && { return std::move(tree_); }

 private:
  const Graph& graph_;
  const PathLimits limits_;
  PathTree tree_;
  std::size_t next_ = 0;          // the node to be looked at next
  std::vector<Neighbour> steps_;  // of the node before, those from step_ on not taken yet
  std::size_t step_ = 0;
};

// T_root_node for every node, composed along the tree with the edges' estimates.
std::vector<SE3> poses_along(const Graph& graph, const PathTree& tree);

}  // namespace relmap
