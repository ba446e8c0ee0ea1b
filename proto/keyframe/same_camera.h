// Whether a session may go on with a header: what it was begun with may not change (CALIBRATION_CHANGED).
#pragma once

#include "proto/keyframe/keyframe.h"

namespace relmap {

// The camera and the flags are those that it began with, and so is the raw calibration where both say what it is: an
// older front-end does not.
inline bool same_camera(const SessionHeader& begun, const SessionHeader& now) {
  return begun.camera == now.camera && begun.oneway == now.oneway && (!begun.raw || !now.raw || *begun.raw == *now.raw);
}

}  // namespace relmap
