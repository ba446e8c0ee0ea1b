// The gain of a simulated camera's automatic exposure.
#pragma once

#include "tools/sim/picture_world_options.h"
#include "tools/sim/wander.h"

namespace relmap::sim {

// A gain that varies slowly along the drive, with jumps that decay as the exposure control recovers.
class Exposure {
 public:
  explicit Exposure(const PictureWorldOptions& options);

  // The gain of frame i, `distance` metres along the drive; 1: as painted.
  double gain(int i, double distance) const;

 private:
  double jump(int i) const;  // factor of a jump at frame i; 1: no jump

  std::uint64_t seed_;
  double variation_, jump_share_;
  Wander wander_;
};

}  // namespace relmap::sim
