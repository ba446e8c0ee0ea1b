// A board that moves before the camera by itself: what an odometry must not take for the world.
#pragma once

#include "proto/geometry/camera.h"
#include "tools/sim/random.h"
#include "tools/sim/scene.h"
#include "tools/sim/trajectory.h"

namespace relmap::sim {

// Upright and rigid; it crosses the view at 0.5 m/s as the camera sees it, and comes nearer and goes away again
// between 2.2 and 2.8 m.
class Board {
 public:
  // As large as covers some 30 % of the camera's picture. Its texture is added to the scene.
  Board(const StereoCamera& camera, Scene& scene, Random random);

  // `seconds` since it appeared, 0 .. 3, while the left camera moves as `motion` says.
  MovingSurface at(double seconds, const Motion& motion) const;

 private:
  Surface surface_;  // in its own coordinates: the middle at the origin, seen along z
};

}  // namespace relmap::sim
