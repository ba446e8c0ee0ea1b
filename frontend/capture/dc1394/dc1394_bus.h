// IIDC cameras on IEEE 1394. libdc1394 serves them, each in a process of its own, relmap-camera-1394: what it may not
// survive (a crash of libdc1394, a hang) costs that camera a restart, and neither this process nor another camera.
#pragma once

#include <memory>
#include <string>

#include "frontend/capture/iidc/camera_link.h"
#include "proto/base/status.h"

namespace relmap::iidc {

struct Dc1394Options {
  std::string program;   // empty: $RELMAP_CAMERA_1394, else relmap-camera-1394 beside the running program
  bool usb_too = false;  // cameras that libdc1394 reaches over USB, and not only those: for tests
  std::string nodes;     // empty: /sys/bus/firewire/devices
};

// UNSUPPORTED: the program is not installed. Whether there is a bus, its cameras() tell. Nothing tells of cameras that
// come and go: wait_for_change() only waits. Processes are started when cameras are opened, also to learn who they are;
// after they crashed, at most every 2 s. open() and links may take up to 5 s where a process hangs.
Result<std::shared_ptr<CameraBus>> open_dc1394_bus(const Dc1394Options& options = {});

}  // namespace relmap::iidc
