// Full bundle adjustment of a map in one Euclidean frame, by Ceres to convergence: what the full relative solution is
// compared with.
#pragma once

#include <unordered_map>
#include <vector>

#include "proto/geometry/camera.h"
#include "storage/map/map.h"
#include "tools/bench/ceres_costs.h"

namespace relmap::bench {

class EuclideanBa {
 public:
  // The map as it is now, unrolled breadth-first from the first frame of its first session, with its observations in
  // force. Frames out of reach and mono landmarks that need a prior are left out.
  explicit EuclideanBa(storage::Map& map);

  // Huber-robust costs, sum over measurements. That before is the relative solution's own where no loop is closed, no
  // edge has a prior and no landmark more observations than enter a solve.
  struct Outcome {
    double cost_before = 0, cost_after = 0;
    int iterations = 0;
    bool converged = false;
    double seconds = 0;
  };
  // The first frame stands still. `huber` in sigmas. With no iterations the costs alone. Throws StatusError
  // (NUMERICAL).
  Outcome solve(double huber, int max_iterations = 500);

  double rms_px() const;  // of all observations, per coordinate
  std::size_t frames() const { return poses_.size(); }
  std::size_t observations() const { return observations_.size(); }
  SE3 T_world_frame(FrameId frame) const { return poses_[index_.at(frame)].pose(); }

 private:
  struct Point {
    double position[3] = {};  // in the world
  };
  struct Seen {
    std::uint32_t frame = 0, point = 0;
    const StereoCamera* camera = nullptr;
    StereoPixel z;
    bool mono = false;
    double sigma = 1;
  };

  std::vector<StereoCamera> cameras_;
  std::vector<CeresPose> poses_;
  std::unordered_map<FrameId, std::uint32_t> index_;
  std::vector<Point> points_;
  std::vector<Seen> observations_;
};

}  // namespace relmap::bench
