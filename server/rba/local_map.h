// The part of the map that a relaxation looks at, in flat arrays by local index. Parts are loaded as they are reached;
// indices follow the order of loading, which depends on the map alone. Estimates are changed here and written back to
// the map at the end, or not at all. One LocalMap serves one relaxation after another, and keeps its memory.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "proto/camera.h"
#include "server/rba/frame_index.h"
#include "storage/graph.h"
#include "storage/path_tree.h"

namespace relmap::rba {

struct LocalEdge {
  EdgeId id;
  std::int32_t a = -1, b = -1;  // frames
  SE3 T_ab;
  bool changed = false;  // since it was loaded
  Matrix6 covariance = Matrix6::Zero();
  bool covariance_changed = false;
  std::int32_t previous = -1;               // edge that with_previous has been found with; -1: not since it was loaded
  Matrix6 with_previous = Matrix6::Zero();  // E[xi xi_previous']
  const Edge* record = nullptr;             // as stored
};

struct LocalLandmark {
  LandmarkId id;
  std::int32_t base = -1;  // frame
  Vector3 abr;
  bool depth_prior = false;
  bool changed = false;
  bool observers_loaded = false;
  const Landmark* record = nullptr;
};

struct LocalObservation {
  std::int32_t frame = -1;
  std::int32_t landmark = -1;
  StereoPixel z;
  double information = 1;  // 1 / sigma^2, per px^2
  bool mono = false;
};

// A step of the graph from some frame.
struct LocalStep {
  std::int32_t edge = -1;
  std::int32_t frame = -1;
  bool forward = false;  // walked a -> b
};

struct LocalFrame {
  FrameId id;
  std::shared_ptr<const FrameHot> hot;
  std::shared_ptr<const FrameWarm> warm;  // once its observations are loaded
  std::int32_t camera = -1;               // of its session
  std::int32_t first_edge = 0;            // hot->edges from here on, in LocalMap's table of them
  std::int32_t first_landmark = 0;        // the same of hot->landmarks
  std::int32_t first_step = -1, end_step = -1;
  std::int32_t first_observation = -1, end_observation = -1;
};

class LocalMap {
 public:
  explicit LocalMap(const Graph& graph) : graph_(graph) {}

  // Forgets what is loaded, and lets go of the map's frames.
  void clear();

  // -1: there is no such frame.
  std::int32_t frame(FrameId id);
  // In increasing edge id. Valid until the next call.
  std::span<const LocalStep> steps(std::int32_t frame);
  // The observations of a frame that are in force, with the landmarks that they mean.
  void load_observations(std::int32_t frame);
  // load_observations() of the first and the last frames that observe the landmark. Those between add little, and where
  // a place is driven through again and again they would be ever more.
  void load_observers(std::int32_t landmark);

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
  std::vector<LocalLandmark> landmarks;
  std::vector<LocalObservation> observations;  // by frame
  std::vector<StereoCamera> cameras;           // of all sessions met so far

 private:
  std::int32_t camera(SessionNumber session);
  std::int32_t edge(std::int32_t frame, std::size_t position);  // of hot->edges
  std::int32_t landmark(LandmarkId id);                         // -1: there is none
  LandmarkId in_force(LandmarkId id);
  bool holds(ClosureId closure);

  const Graph& graph_;
  FrameIndex index_;
  std::pair<FrameId, std::int32_t> last_{{}, -1};  // asked for
  std::vector<std::int32_t> edge_at_;              // frame by frame: local edges of hot->edges, -1: not loaded
  std::vector<std::int32_t> landmark_at_;          // what hot->landmarks mean, -1: not loaded
  std::vector<std::pair<SessionNumber, std::int32_t>> camera_of_session_;  // kept: a session's camera never changes
  std::vector<LocalStep> steps_;
  // Scratch of searches: visited_[frame] == visit_ if the frame has been found by the present one.
  std::vector<std::uint32_t> visited_;
  std::vector<std::uint32_t> wanted_;
  std::uint32_t visit_ = 0;
  std::vector<TreeNode> search_;
  std::vector<std::int32_t> renumbered_;
};

}  // namespace relmap::rba
