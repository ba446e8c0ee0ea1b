// How fast a camera may send over its bus.
#pragma once

#include <dc1394/dc1394.h>

#include "proto/base/status.h"

namespace relmap::iidc::dc1394 {

// 800 Mbit/s where the camera and all that lies between can (IEEE 1394b), else 400 or what there is. IO_ERROR: the
// camera refuses.
Status set_iso_speed(dc1394camera_t& camera);

}  // namespace relmap::iidc::dc1394
