// Renders pictures with motion blur.
#pragma once

#include <vector>

#include "proto/geometry/camera.h"
#include "tools/sim/renderer.h"

namespace relmap::sim {

// A moving eye. Velocities are in its own axes, m/s and rad/s.
struct MovingEye {
  SE3 T_world_eye;  // at the middle of the exposure
  Vector3 velocity;
  Vector3 angular_velocity;
};

// shade() averaged over an exposure. The picture is rendered once, for the middle of the exposure, and each pixel is
// averaged along its flow with one tap a pixel: 55 to 63 ms for a stereo pair of 512 x 384 instead of 37. The flow is
// assumed constant over the exposure, so that at occlusions a band as wide as the blur takes light from the wrong
// surface. To render at as many instants as the flow has pixels would be exact there too, but ten to thirty times
// slower.
std::vector<float> shade_blurred(const Snapshot& snapshot, const StereoCamera& camera, const MovingEye& eye,
                                 double exposure_s);

}  // namespace relmap::sim
