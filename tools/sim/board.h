// A board that moves in front of the camera by itself, which odometry must not take for the fixed world.
#pragma once

#include "proto/geometry/camera.h"
#include "tools/sim/random.h"
#include "tools/sim/scene.h"
#include "tools/sim/trajectory.h"

namespace relmap::sim {

// An upright rigid board that crosses the view at 0.5 m/s relative to the camera, at a distance that varies between 2.2
// and 2.8 m.
class Board {
 public:
  // The board covers some 30 % of the picture. Its texture is added to the scene.
  Board(const StereoCamera& camera, Scene& scene, Random random);

  // The board `seconds` (0 to 3) after it appeared. `motion`: of the left camera at that time.
  MovingSurface at(double seconds, const Motion& motion) const;

 private:
  Surface surface_;  // in the board's coordinates: its middle is the origin, and it is seen along z
};

}  // namespace relmap::sim
