// A camera and where it is, for the tests that estimate poses and lenses from what it sees.
#pragma once

#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::vision::testing_view {

// It has no right eye.
inline constexpr StereoCamera kMonoCamera{640, 319.5, 239.5, 0, 640, 480};
inline const SE3 kPose = SE3::exp((Vector6() << 0.4, -0.1, 0.8, 0.05, -0.2, 0.03).finished());

}  // namespace relmap::vision::testing_view
