// What falls on a picture while its eye moves.
#pragma once

#include <vector>

#include "proto/geometry/camera.h"
#include "tools/sim/renderer.h"

namespace relmap::sim {

// The velocities are in the eye's own axes: m/s and rad/s.
struct MovingEye {
  SE3 T_world_eye;  // in the middle of the exposure
  Vector3 velocity;
  Vector3 angular_velocity;
};

// shade(), averaged over an exposure. The picture of its middle is rendered once, and each pixel gathers along its own
// flow, with a tap a pixel: 55 to 63 ms for a stereo pair of 512 x 384 instead of 37. Flow is taken as constant over
// the exposure; where a near thing moves before a far one, a band of the blur's width takes light from the wrong one of
// the two. Rendering instead at as many instants as the flow is pixels long would be right there too, and ten to thirty
// times as slow.
std::vector<float> shade_blurred(const Snapshot& snapshot, const StereoCamera& camera, const MovingEye& eye,
                                 double exposure_s);

}  // namespace relmap::sim
