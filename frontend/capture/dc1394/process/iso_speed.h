// Sets how fast a camera may send over its bus.
#pragma once

#include <dc1394/dc1394.h>

#include "proto/base/status.h"

namespace relmap::iidc::dc1394 {

// 800 Mbit/s if the camera and everything between support it (IEEE 1394b), otherwise 400 or the maximum. IO_ERROR if
// the camera refuses.
Status set_iso_speed(dc1394camera_t& camera);

}  // namespace relmap::iidc::dc1394
