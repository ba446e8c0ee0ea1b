// The part of the map that a relaxation looks at, in flat arrays by local index: the graph, and over it estimates,
// landmarks in force and observations. Parts are loaded as they are reached; indices follow the order of loading, which
// depends on the map alone. Estimates are changed here and written back to the map at the end, or not at all. One
// LocalMap serves one relaxation after another, and keeps its memory.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "proto/geometry/camera.h"
#include "storage/graph/local_graph.h"

namespace relmap::rba {

struct EdgeEstimate {
  SE3 T_ab;
  bool changed = false;  // since it was loaded
  Matrix6 covariance = Matrix6::Zero();
  bool covariance_changed = false;
  std::int32_t previous = -1;               // edge that with_previous has been found with; -1: not since it was loaded
  Matrix6 with_previous = Matrix6::Zero();  // E[xi xi_previous']
};

struct LocalLandmark {
  LandmarkId id;
  std::int32_t base = -1;  // frame
  Vector3 abr;
  bool depth_prior = false;
  bool changed = false;
  bool observers_loaded = false;
  bool settled = false;  // storage/graph/observers.h
  bool frozen = false;   // its base is of a frozen session
  const storage::Landmark* record = nullptr;
};

struct LocalObservation {
  std::int32_t frame = -1;
  std::int32_t landmark = -1;
  StereoPixel z;
  double information = 1;  // 1 / sigma^2, per px^2
  bool mono = false;
};

// What a frame has observed, once that is loaded.
struct LocalView {
  std::int32_t camera = -1;           // of its session
  std::int32_t first = -1, end = -1;  // in LocalMap::observations; -1: not loaded
};

class LocalMap : public storage::LocalGraph {
 public:
  explicit LocalMap(const storage::Graph& graph) : storage::LocalGraph(graph) {}

  // Forgets what is loaded, and lets go of the map's frames.
  void clear();
  // Sessions of which nothing moves, from the next clear() on.
  void freeze(std::vector<SessionNumber> sessions) { frozen_ = std::move(sessions); }
  bool is_frozen(std::int32_t frame) const { return is_frozen(frames[frame].id.session); }

  EdgeEstimate& estimate(std::int32_t edge);
  const LocalView& view(std::int32_t frame);
  // The observations of a frame that are in force, with the landmarks that they mean.
  void load_observations(std::int32_t frame);
  // load_observations() of the landmark's observers.
  void load_observers(std::int32_t landmark);
  // Whether settled landmarks were measured from here, as many as hold an edge without a prior: what comes later has
  // nothing to add to the frame's place among them.
  bool frame_is_settled(std::int32_t frame);

  std::vector<EdgeEstimate> estimates;  // by edge, as far as they have been asked for
  std::vector<LocalLandmark> landmarks;
  std::vector<LocalObservation> observations;  // by frame
  std::vector<StereoCamera> cameras;           // of sessions met, in earlier relaxations too: they never change

 private:
  bool is_frozen(SessionNumber session) const {
    return std::find(frozen_.begin(), frozen_.end(), session) != frozen_.end();
  }
  std::int32_t camera(SessionNumber session);
  std::int32_t landmark(LandmarkId id);  // -1: there is none
  // What a landmark of a loaded frame means; -1: not known yet.
  std::int32_t& landmark_at(std::int32_t frame, std::uint32_t slot);
  LandmarkId in_force(LandmarkId id);
  bool holds(ClosureId closure);

  std::vector<LocalView> views_;              // by frame, as far as they have been asked for
  std::vector<std::int8_t> settled_;          // the same; -1: not asked for
  std::vector<std::int32_t> first_landmark_;  // by frame, in landmark_at_; the same
  std::vector<std::int32_t> landmark_at_;
  std::vector<std::pair<SessionNumber, std::int32_t>> camera_of_session_;
  std::vector<SessionNumber> frozen_;
};

}  // namespace relmap::rba
