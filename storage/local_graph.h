// The part of the graph that searches have reached, by local index: frames, edges and steps are read from the graph
// once, however many searches come by. Indices follow the order of reading, which depends on the graph alone. The graph
// must not change meanwhile; after it has, clear() begins anew, in the memory that there is.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "storage/frame_index.h"
#include "storage/graph.h"

namespace relmap {

struct LocalFrame {
  FrameId id;
  std::shared_ptr<const FrameHot> hot;
  std::int32_t first_edge = 0;  // hot->edges from here on, in LocalGraph's table of them
  std::int32_t first_step = -1, end_step = -1;
};

struct LocalEdge {
  EdgeId id;
  std::int32_t a = -1, b = -1;   // frames; a: -1 if it is lost
  const Edge* record = nullptr;  // as stored
};

// A step of the graph from some frame.
struct LocalStep {
  std::int32_t edge = -1;
  std::int32_t frame = -1;
  bool forward = false;  // walked a -> b
};

class LocalGraph {
 public:
  explicit LocalGraph(const Graph& graph) : graph_(graph) {}

  // Lets go of the map's frames.
  void clear();

  // -1: there is no such frame.
  std::int32_t frame(FrameId id);
  // In increasing edge id. Valid until the next call.
  std::span<const LocalStep> steps(std::int32_t frame);

  // Appends the `count` frames nearest to `root` in the graph, itself first, breadth-first.
  void nearest(std::int32_t root, std::uint32_t count, std::vector<std::int32_t>* found);

  // build_path_tree(root), cut to what leads to `targets`, and broken off when all of them have been found.
  struct TreeNode {
    std::int32_t frame = -1;
    std::int32_t parent = -1;  // node of this tree; -1: the root
    std::int32_t edge = -1;
    bool forward = false;
    std::uint32_t depth = 0;
  };
  // Appends it, parents before children, the root first. Targets out of reach are not in it.
  void path_tree(std::int32_t root, std::span<const std::int32_t> targets, std::vector<TreeNode>* nodes);

  std::vector<LocalFrame> frames;
  std::vector<LocalEdge> edges;

 protected:
  const Graph& graph_;

 private:
  std::int32_t edge(std::int32_t frame, std::size_t position);  // of hot->edges

  FrameIndex index_;
  std::pair<FrameId, std::int32_t> last_{{}, -1};  // asked for
  std::vector<std::int32_t> edge_at_;              // frame by frame: local edges of hot->edges, -1: not loaded
  std::vector<LocalStep> steps_;
  // Scratch of searches: visited_[frame] == visit_ if the frame has been found by the present one.
  std::vector<std::uint32_t> visited_;
  std::vector<std::uint32_t> wanted_;
  std::uint32_t visit_ = 0;
  std::vector<TreeNode> search_;
  std::vector<std::int32_t> renumbered_;
};

}  // namespace relmap
