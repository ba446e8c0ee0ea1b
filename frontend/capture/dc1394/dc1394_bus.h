// IIDC cameras on IEEE 1394. libdc1394 serves each in a process of its own, relmap-camera-1394, so that a crash or hang
// of libdc1394 costs that camera a restart, and affects neither this process nor other cameras.
#pragma once

#include <memory>
#include <string>

#include "frontend/capture/iidc/camera_link.h"
#include "proto/base/status.h"

namespace relmap::iidc {

struct Dc1394Options {
  // If empty, $RELMAP_CAMERA_1394, or else relmap-camera-1394 beside the running program, or in ../lib/relmap.
  std::string program;
  bool usb_too = false;  // also the cameras that libdc1394 reaches over USB; for tests
  std::string nodes;     // if empty, /sys/bus/firewire/devices
};

// UNSUPPORTED if the program is not installed; cameras() says whether there is a bus. Cameras that come and go are not
// noticed: wait_for_change() only waits. A process is started whenever a camera is opened, also to identify it; after
// crashes, at most every 2 s. If a process hangs, open() and links may take up to 5 s.
Result<std::shared_ptr<CameraBus>> open_dc1394_bus(const Dc1394Options& options = {});

}  // namespace relmap::iidc
