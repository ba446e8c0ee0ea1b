// The part of the map that a relaxation reads, in flat arrays by local index: the graph, estimates of its edges,
// landmarks in force and observations. Each part is loaded when it is first asked for. Indices follow the order of
// loading, which depends on the map alone. Estimates are changed here; the caller writes them back to the map at the
// end, or not at all. One LocalMap serves one relaxation after another and reuses its memory.
#pragma once

#include <algorithm>
#include <cstdint>
#include <unordered_set>
#include <utility>
#include <vector>

#include "proto/geometry/camera.h"
#include "storage/graph/local_graph.h"

namespace relmap::rba {

struct EdgeEstimate {
  SE3 T_ab;
  bool changed = false;  // T_ab changed since it was loaded
  Matrix6 covariance = Matrix6::Zero();
  bool covariance_changed = false;
  std::int32_t previous = -1;               // the edge of with_previous; -1: with_previous has not been computed
  Matrix6 with_previous = Matrix6::Zero();  // E[xi xi_previous']
};

struct LocalLandmark {
  LandmarkId id;
  std::int32_t base = -1;  // local frame
  Vector3 abr;             // (a, b, rho), measurement.h
  bool depth_prior = false;
  bool changed = false;
  bool observers_loaded = false;
  bool fixed = false;   // storage/graph/observers.h
  bool frozen = false;  // its base belongs to a frozen session
  const storage::Landmark* record = nullptr;
};

struct LocalObservation {
  std::int32_t frame = -1;
  std::int32_t landmark = -1;
  StereoPixel z;
  double information = 1;  // 1 / sigma^2, per px^2
  bool mono = false;
};

// The observations of a frame.
struct LocalView {
  std::int32_t camera = -1;           // the session's, in LocalMap::cameras
  std::int32_t first = -1, end = -1;  // range in LocalMap::observations; -1: not loaded
};

class LocalMap : public storage::LocalGraph {
 public:
  explicit LocalMap(const storage::Graph& graph) : storage::LocalGraph(graph) {}

  // Forgets everything loaded and releases the map's frames.
  void clear();
  // Whether nothing of the session moves, which at first all does. Takes effect at the next clear().
  void freeze(SessionNumber session, bool stands_still) {
    if (stands_still)
      frozen_.insert(session);
    else
      frozen_.erase(session);
  }
  bool is_frozen(std::int32_t frame) const { return is_frozen(frames[frame].id.session); }

  EdgeEstimate& estimate(std::int32_t edge);
  const LocalView& view(std::int32_t frame);
  // Loads the frame's observations that are in force, with the landmarks in force that they stand for.
  void load_observations(std::int32_t frame);
  // Calls load_observations() for each of the landmark's observers.
  void load_observers(std::int32_t landmark);
  // Whether the frame is among the observers of as many fixed landmarks as hold an edge without a prior (kMinSupport).
  // Later measurements add nothing to the position of such a frame.
  bool frame_is_fixed(std::int32_t frame);

  std::vector<EdgeEstimate> estimates;  // by edge, up to the last that estimate() was asked for
  std::vector<LocalLandmark> landmarks;
  std::vector<LocalObservation> observations;  // those of one frame are consecutive
  std::vector<StereoCamera> cameras;           // by session; kept from earlier relaxations, since they never change

 private:
  bool is_frozen(SessionNumber session) const { return !frozen_.empty() && frozen_.contains(session); }
  std::int32_t camera(SessionNumber session);
  std::int32_t landmark(LandmarkId id);  // -1: there is none
  // The local landmark in force that a stored landmark of a loaded frame stands for; -1: not known yet.
  std::int32_t& landmark_at(std::int32_t frame, std::uint32_t slot);
  LandmarkId in_force(LandmarkId id);
  bool holds(ClosureId closure);

  // By frame, up to the last that was asked for:
  std::vector<LocalView> views_;
  std::vector<std::int8_t> frame_fixed_;      // 0, 1; -1: not computed
  std::vector<std::int32_t> first_landmark_;  // in landmark_at_
  std::vector<std::int32_t> landmark_at_;
  std::vector<std::pair<SessionNumber, std::int32_t>> camera_of_session_;
  std::unordered_set<SessionNumber> frozen_;
};

}  // namespace relmap::rba
