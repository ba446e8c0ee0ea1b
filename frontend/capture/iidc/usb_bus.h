// IIDC cameras over USB, by libusb: registers by vendor control transfers, frames by bulk transfers, several of them in
// flight.
#pragma once

#include <memory>

#include "frontend/capture/iidc/camera_link.h"
#include "proto/base/status.h"

namespace relmap::iidc {

// Not only the cameras listed in usb_ids.h: with `also`, of vendor << 16 | product, others that speak the same.
// UNSUPPORTED: USB cannot be had at all, with libusb's reason.
Result<std::shared_ptr<CameraBus>> open_usb_bus(std::vector<std::uint32_t> also = {});

}  // namespace relmap::iidc
