// What stands for the camera of a session that was imported without pictures.
#pragma once

#include "proto/geometry/camera.h"

namespace relmap {

// A session must have a camera; nothing is measured with this one.
inline constexpr StereoCamera kNoCamera{500, 320, 240, 0.1, 640, 480};

}  // namespace relmap
