// The buses that programs look for cameras on.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "frontend/capture/iidc/camera_link.h"
#include "proto/base/status.h"

namespace relmap::iidc {

// "usb", "1394", or "auto": both, as far as they can be had. UNSUPPORTED: none can.
Result<std::vector<std::shared_ptr<iidc::CameraBus>>> open_camera_buses(const std::string& which);

}  // namespace relmap::iidc
