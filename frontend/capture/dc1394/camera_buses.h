// Opens the buses on which programs look for cameras.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "frontend/capture/iidc/camera_link.h"
#include "proto/base/status.h"

namespace relmap::iidc {

// `which` is "usb", "1394", or "auto" for both as far as they are available. UNSUPPORTED if none is.
Result<std::vector<std::shared_ptr<iidc::CameraBus>>> open_camera_buses(const std::string& which);

}  // namespace relmap::iidc
