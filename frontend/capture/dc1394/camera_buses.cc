#include "frontend/capture/dc1394/camera_buses.h"

#include <utility>

#include "frontend/capture/dc1394/dc1394_bus.h"
#include "frontend/capture/iidc/usb_bus.h"

namespace relmap::iidc {

Result<std::vector<std::shared_ptr<iidc::CameraBus>>> open_camera_buses(const std::string& which) {
  std::vector<std::shared_ptr<iidc::CameraBus>> buses;
  Status trouble(Reason::INVALID_ARGUMENT, "no bus: '" + which + "'; known: usb, 1394, auto");
  const auto add = [&](const char* name, auto open) {
    if (which != "auto" && which != name) return;
    auto bus = open();
    if (bus.ok())
      buses.push_back(*std::move(bus));
    else
      trouble = bus.status();
  };
  add("usb", [] { return iidc::open_usb_bus(); });
  add("1394", [] { return iidc::open_dc1394_bus(); });
  if (buses.empty()) return trouble;
  return buses;
}

}  // namespace relmap::iidc
