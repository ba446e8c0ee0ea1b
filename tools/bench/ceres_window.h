// The usual alternative to relative bundle adjustment: a sliding window in one Euclidean frame, by Ceres with analytic
// Jacobians (DENSE_SCHUR, one thread). The newest frames are adjusted; older ones that see their landmarks are
// constant. The problem is built anew for every keyframe, as in local bundle adjustment. Loops are not closed.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"
#include "proto/keyframe/keyframe.h"
#include "tools/bench/ceres_costs.h"

namespace relmap::bench {

struct CeresWindowOptions {
  std::uint32_t window = 8;
  int max_iterations = 6;
  double huber = 2;                 // sigmas
  double relative_decrease = 1e-2;  // of the cost; a step that gains less ends the solve
};

class CeresWindow {
 public:
  CeresWindow(const StereoCamera& camera, CeresWindowOptions options) : camera_(camera), options_(options) {}

  // Adds a keyframe and adjusts the window. Keyframes must come in the order of their sequences, from 0, without gaps.
  // Returns the seconds that the adjustment took, including building the problem.
  double add(const Keyframe& keyframe);

  // T_world_frame of all frames; the world is the first frame.
  std::vector<SE3> poses() const;

 private:
  struct Sighting {
    std::uint32_t frame = 0;
    StereoPixel z;
    double sigma = 1;
  };
  struct Landmark {
    double position[3] = {};  // in the world
    std::vector<Sighting> sightings;
  };

  std::uint32_t landmark_of(const TrackMeasurement& track);
  double adjust(std::uint32_t newest);
  SE3 pose(std::uint32_t frame) const;

  const StereoCamera camera_;
  const CeresWindowOptions options_;
  SE3 odometry_;  // of the last keyframe
  std::vector<CeresPose> poses_;
  std::vector<Landmark> landmarks_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> of_track_;
  std::vector<std::vector<std::uint32_t>> seen_;  // landmarks, by frame
};

}  // namespace relmap::bench
