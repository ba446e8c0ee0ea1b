// The part of the graph that searches have reached, by local index. Frames, edges and steps are read from the graph
// once, however many searches use them. Indices follow the order of reading, which depends on the graph alone. The
// graph must not change meanwhile; after a change, clear() starts afresh and keeps the memory.
//
// Paths between a landmark's base and its observers (docs/method.md, 2). A walk *up* from a frame follows the motion of
// its session in both directions, and loop edges from the newer end to the older one. It never meets what newer frames
// have added, so it is as short in a place that has been passed a thousand times as in one that has been passed twice.
// Path(j, i) goes up from j and down to i, by way of the frame where both walks together are shortest.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "storage/graph/frame_index.h"
#include "storage/graph/graph.h"

namespace relmap::storage {

struct LocalFrame {
  FrameId id;
  std::shared_ptr<const FrameHot> hot;
  std::int32_t first_edge = 0;  // where hot->edges begins in LocalGraph's table of local edges
  std::int32_t first_step = -1, end_step = -1;
};

struct LocalEdge {
  EdgeId id;
  std::int32_t a = -1, b = -1;   // local frames; a is -1 if that frame is lost
  const Edge* record = nullptr;  // as stored
};

// A step of a walk up from some frame.
struct LocalStep {
  std::int32_t edge = -1;
  std::int32_t frame = -1;
  bool forward = false;  // walked a -> b
};

inline constexpr std::uint32_t kWalkDepth = 15;     // depth of a walk up in edges; so a path has at most D = 30
inline constexpr std::uint32_t kWalkFrames = 1000;  // frames of a walk up; it ends there
inline constexpr std::uint32_t kPathDepth = 2 * kWalkDepth;

class LocalGraph {
 public:
  explicit LocalGraph(const Graph& graph) : graph_(graph) {}

  const Graph& graph() const { return graph_; }

  // Forgets everything and releases the map's frames.
  void clear();

  // The local index of a frame; -1 if there is no such frame.
  std::int32_t frame(FrameId id);
  // The steps up from a frame, in increasing order of edge id. Valid until the next call.
  std::span<const LocalStep> steps(std::int32_t frame);

  // Appends the first `count` frames of the walk up from `root`, beginning with `root` itself.
  void nearest(std::int32_t root, std::uint32_t count, std::vector<std::int32_t>* found);

  // A frame of a walk up, in breadth-first order; the first is where the walk begins.
  struct WalkNode {
    std::int32_t frame = -1;
    std::int32_t parent = -1;
    std::int32_t edge = -1;
    bool forward = false;   // from the parent, the edge is walked a -> b
    bool by_motion = true;  // reached by motion alone, along the root's session
    std::int32_t depth = 0;
  };
  // The whole walk up from a frame. Valid until the next call.
  const std::vector<WalkNode>& walk_up(std::int32_t frame) { return walk(frame, kWalkDepth).nodes; }

  // T_frame_node of each node of walk_up(frame), compounded from the edges' estimates.
  std::vector<SE3> poses_up(std::int32_t frame);

  // Finds Path(base, observer), the steps from `base` to `observer`. Of the shortest paths it takes the one that turns
  // nearest to the observer, and of those the one found first, breadth-first in increasing order of edge id. False if
  // the observer is out of reach, or if an argument is -1.
  bool path(std::int32_t base, std::int32_t observer, std::vector<LocalStep>* steps);

  // A node of the tree of the paths from a base to several observers. Common beginnings are in it once.
  struct TreeNode {
    std::int32_t frame = -1;
    std::int32_t parent = -1;  // node of this tree; -1: the root
    std::int32_t edge = -1;
    bool forward = false;
  };
  // Appends the nodes of the tree to `nodes`, the root first and parents before children, and to `ends` for each
  // observer the node at which its path ends; -1 if it is out of reach.
  void path_tree(std::int32_t base, std::span<const std::int32_t> observers, std::vector<TreeNode>* nodes,
                 std::vector<std::int32_t>* ends);

  std::vector<LocalFrame> frames;
  std::vector<LocalEdge> edges;

 protected:
  const Graph& graph_;

 private:
  struct Walk {
    std::vector<WalkNode> nodes;
    std::array<std::int32_t, kWalkDepth + 2> level{};  // nodes of depth d: from level[d] to level[d + 1]
    std::int32_t grown = -1;                           // levels known: 0 .. grown
    std::int32_t first_loop = kNoLoop;                 // the first known level with a node that is not by_motion
    static constexpr std::int32_t kNoLoop = kWalkDepth + 1;
  };
  // Where a path turns: nodes of the walks of its base and its observer; -1: out of reach.
  struct Turn {
    std::int32_t from_base = -1;
    std::int32_t from_observer = -1;
  };

  std::int32_t edge(std::int32_t frame, std::size_t position);  // `position` in hot->edges
  // The walk up from a frame, grown to `depth` at least. Valid until a frame is asked for that was not before.
  const Walk& walk(std::int32_t frame, std::int32_t depth);
  void extend(std::int32_t frame, Walk& walk);
  Turn find_turn(std::int32_t base, std::int32_t observer);
  // Maps frames to nodes of the base's walk in node_of_: mark() begins for a base, mark_more() enters more of its walk
  // and returns false when all of it has been entered.
  void mark(std::int32_t base);
  bool mark_more();

  FrameIndex index_;
  std::pair<FrameId, std::int32_t> last_{{}, -1};  // the frame asked for last
  std::vector<std::int32_t> edge_at_;              // frame by frame, the local edges of hot->edges; -1: not read yet
  std::vector<LocalStep> steps_;
  std::vector<Walk> walks_;  // those in use first; the others keep their memory
  std::size_t walks_used_ = 0;
  std::vector<std::int32_t> walk_of_;  // by frame; -1: none
  // Scratch of searches: visited_[frame] == visit_ if the frame has been found by the present one.
  std::vector<std::uint32_t> visited_;
  std::uint32_t visit_ = 0;
  std::int32_t marked_ = -1;      // the base of node_of_
  std::size_t marked_nodes_ = 0;  // nodes of its walk that are in node_of_
  std::vector<std::int32_t> node_of_;
  std::vector<std::int32_t> tree_node_of_, first_child_, next_sibling_;
  std::vector<std::int32_t> upwards_;
};

}  // namespace relmap::storage
