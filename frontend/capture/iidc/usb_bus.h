// IIDC cameras over USB, by libusb: registers by vendor control transfers, frames by bulk transfers, of which several
// are in flight.
#pragma once

#include <memory>

#include "frontend/capture/iidc/camera_link.h"
#include "proto/base/status.h"

namespace relmap::iidc {

// The bus has the cameras listed in usb_ids.h and, by `also` (vendor << 16 | product), others with the same protocol.
// UNSUPPORTED if USB is not available, with libusb's reason.
Result<std::shared_ptr<CameraBus>> open_usb_bus(std::vector<std::uint32_t> also = {});

}  // namespace relmap::iidc
