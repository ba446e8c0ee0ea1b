// Whether two pictures are what the left and the right eye of a stereo camera see at once.
#pragma once

#include "frontend/tracking/pair.h"
#include "proto/status.h"

namespace relmap {

// For a pair that could not be tracked. NOT_STEREO where it shows why: both eyes have the same picture, or each has the
// other's. OK otherwise, also where there is too little to see to tell.
Status check_eyes(const Pair& pair);

}  // namespace relmap
