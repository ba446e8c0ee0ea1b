// A USB bus of simulated cameras that unmodified drivers find and open, in this process (restarted by under_mock.h) and
// its child processes. At most one testbed at a time.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "tests/camera/simulated_camera.h"
#include "tests/camera/usb_port.h"

namespace relmap::testing {

struct UsbTestbedOptions {
  bool split_transfers = false;  // simulates an old host, where drivers split transfers longer than 16 KiB
};

// Every driver must have closed its devices before the testbed is destroyed.
class UsbTestbed {
 public:
  explicit UsbTestbed(UsbTestbedOptions options = {});
  ~UsbTestbed();
  UsbTestbed(const UsbTestbed&) = delete;
  UsbTestbed& operator=(const UsbTestbed&) = delete;

  enum class Access { kAll, kNobody };
  // Plugs a camera in, with power switched on anew. A camera that is plugged in again gets the next device number.
  void plug(const std::shared_ptr<SimulatedCamera>& camera, Access access = Access::kAll);
  void unplug(const std::shared_ptr<SimulatedCamera>& camera);
  // Unplugs the camera when half of a frame is sent. False if no frame came; the camera is then still plugged in.
  bool unplug_in_mid_frame(const std::shared_ptr<SimulatedCamera>& camera,
                           std::chrono::milliseconds patience = std::chrono::seconds(2));

  // The counters since the camera was plugged in last.
  UsbCounters counters(const std::shared_ptr<SimulatedCamera>& camera) const;

  // UMOCKDEV_DIR, which is set in this process's environment.
  const std::string& folder() const;

 private:
  class Bus;
  struct Device;
  Device& device(const std::shared_ptr<SimulatedCamera>& camera) const;

  const UsbTestbedOptions options_;
  std::unique_ptr<Bus> bus_;
  std::vector<std::unique_ptr<Device>> devices_;  // those unplugged, too: drivers may still hold them
};

}  // namespace relmap::testing
