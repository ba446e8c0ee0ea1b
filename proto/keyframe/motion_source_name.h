// Names of motion sources, for display.
#pragma once

#include "proto/keyframe/keyframe.h"

namespace relmap {

// "constant velocity"
const char* name_of(MotionSource source);

}  // namespace relmap
