// Full bundle adjustment of a map in one Euclidean frame, by Ceres to convergence, for comparison with the full
// relative solution.
#pragma once

#include <unordered_map>
#include <vector>

#include "proto/geometry/camera.h"
#include "storage/map/map.h"
#include "tools/bench/ceres_costs.h"

namespace relmap::bench {

class EuclideanBa {
 public:
  // Starts from the map as it is now, unrolled breadth-first from the first frame of its first session, with the
  // observations in force. Frames that are not connected, and mono landmarks that need a prior, are left out.
  explicit EuclideanBa(storage::Map& map);

  // Huber-robust costs, summed over measurements. The cost before equals that of the relative solution if no loop is
  // closed, no edge has a prior, and no landmark has more observations than enter a solve.
  struct Outcome {
    double cost_before = 0, cost_after = 0;
    int iterations = 0;
    bool converged = false;
    double seconds = 0;
  };
  // Adjusts everything but the first frame. `huber` in sigmas. With max_iterations 0 only computes the costs. Throws
  // StatusError (NUMERICAL).
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
