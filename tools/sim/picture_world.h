// A textured world made from a seed, and a stereo camera driven round it: pictures with exact truth.
//
// The world is a closed street with houses on both sides, pavements, posters, trees, or a motorway. The camera goes
// round it, a little beside its own track on each lap, turned by a few degrees. World coordinates: y down, the ground
// at y = 0, x and z in the plane; metres. Everything is a function of the options.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "proto/geometry/geometry.h"
#include "tools/sim/picture_world_options.h"
#include "tools/sim/trajectory.h"

namespace relmap::sim {

// Grey, row by row.
struct GreyPicture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;
};

struct StereoPictures {
  GreyPicture left, right;
};

// Immutable: every function may be called from any thread.
class PictureWorld {
 public:
  explicit PictureWorld(const PictureWorldOptions& options);  // options.check() must be OK; takes about a second
  ~PictureWorld();
  PictureWorld(PictureWorld&&) noexcept;
  PictureWorld& operator=(PictureWorld&&) noexcept;

  const PictureWorldOptions& options() const;
  // Of frame i, 0 .. frames - 1. T_world_left: the left camera in the world, at the frame's true time.
  SE3 truth(int i) const;
  std::int64_t time_us(int i) const;  // its stamp, which a fault may make wrong
  // What is wrong with pair i. A dropped pair can be rendered, but no one gets to see it.
  FaultKind fault_at(int i) const;
  bool dropped(int i) const;
  const std::vector<FaultEpisode>& faults() const;  // by beginning, without single drops by chance
  // At any real number of seconds since frame 0.
  SE3 truth_at(double seconds) const;
  sim::Motion motion_at(double seconds) const;
  // Of a drive with rides: the robot stands in what may carry it; and that moves, with it.
  bool riding(int i) const;
  bool carried(int i) const;
  StereoPictures render(int i) const;
  // Depth (z) at each left pixel's centre, metres; row by row.
  std::vector<float> render_depth(int i) const;
  // Which of the left pixels show what is no part of the fixed world: cars, and what carries the robot.
  std::vector<bool> moving(int i) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace relmap::sim
