// The gain of a simulated camera's automatic exposure.
#pragma once

#include "tools/sim/picture_world_options.h"
#include "tools/sim/wander.h"

namespace relmap::sim {

// A slow wander along the drive, and jumps that die away as the control finds back.
class Exposure {
 public:
  explicit Exposure(const PictureWorldOptions& options);

  // Of frame i, `distance` metres along the drive; 1: as painted.
  double gain(int i, double distance) const;

 private:
  double jump(int i) const;  // by what the gain jumps at frame i; 1: not

  std::uint64_t seed_;
  double variation_, jump_share_;
  Wander wander_;
};

}  // namespace relmap::sim
