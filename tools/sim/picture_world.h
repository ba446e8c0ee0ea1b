// A textured world made from a seed, and a stereo camera that drives round it: pictures with exact truth.
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
  // T_world_left of frame i (0 to frames - 1) at the frame's true time.
  SE3 truth(int i) const;
  std::int64_t time_us(int i) const;  // time stamp of frame i, which a fault may make wrong
  // The fault of pair i. A dropped pair can be rendered, but is not delivered.
  FaultKind fault_at(int i) const;
  bool dropped(int i) const;
  const std::vector<FaultEpisode>& faults() const;  // sorted by their beginnings, without randomly dropped pairs
  // Truth and motion at any real number of seconds since frame 0.
  SE3 truth_at(double seconds) const;
  sim::Motion motion_at(double seconds) const;
  // For a drive with rides: whether the robot is in a carrier, and whether that moves with it.
  bool riding(int i) const;
  bool carried(int i) const;
  StereoPictures render(int i) const;
  // Depth (z) at each left pixel's centre, metres; row by row.
  std::vector<float> render_depth(int i) const;
  // For each left pixel, whether it shows something that is not part of the fixed world: cars, carriers.
  std::vector<bool> moving(int i) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace relmap::sim
