// Updates what is derived from the accepted graph and the closures in force: the observers of each landmark, in reach
// and out of reach, the number of observations whose path uses each edge (support), and which edges need their prior
// (docs/method.md, 2).
#pragma once

#include <functional>
#include <map>
#include <set>
#include <vector>

#include "storage/graph/local_graph.h"
#include "storage/map/map.h"

namespace relmap::map {

// Paths from several bases to one frame, each searched only once. The graph must not change meanwhile.
class PathsTo {
 public:
  PathsTo(const storage::Graph& graph, FrameId frame) : frame_(frame), local_(graph) {}

  FrameId frame() const { return frame_; }
  // The edges of the path; null if the base is out of reach. Valid as long as this object.
  const std::vector<EdgeId>* find(FrameId base);
  bool reachable_from(FrameId base) { return find(base) != nullptr; }

 private:
  struct Path {
    bool reachable = false;
    std::vector<EdgeId> edges;
  };
  const FrameId frame_;
  storage::LocalGraph local_;
  std::map<FrameId, Path> paths_;
  std::vector<storage::LocalStep> steps_;
};

// Call once the observations of the new frame paths.frame() are stored. Adds the frame to its landmarks' observers, and
// its paths to the support of their edges.
void add_support(storage::EditableGraph& map, PathsTo& paths);

// Runs `change`, which may change the graph, which closures are in force, their claims and bound observations, and
// updates everything derived from these. `frames` must contain all frames that have an observation whose landmark or
// path may differ afterwards, and all that are deleted; additional frames do no harm. Returns the edges that
// observations used before and none uses now, ascending.
std::vector<EdgeId> change_support(storage::EditableGraph& map, const std::set<FrameId>& frames,
                                   const std::function<void()>& change);

// Adds the frames that see a landmark, in reach or not. For a fixed landmark, whose list of observers is incomplete,
// adds all frames in reach of its base.
void add_observers(const storage::Graph& graph, LandmarkId landmark, std::set<FrameId>* frames);

// Adds the frames with an observation whose path may differ when edges that end in `newer_ends` come or go.
void add_frames_beyond(const storage::Graph& graph, const std::vector<FrameId>& newer_ends, std::set<FrameId>* frames);

}  // namespace relmap::map
