// A USB bus of simulated cameras that unmodified drivers find and open: in this process, started under_mock.h, and in
// those that it starts. At most one at a time.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "tests/camera/simulated_camera.h"
#include "tests/camera/usb_port.h"

namespace relmap::testing {

struct UsbTestbedOptions {
  bool split_transfers = false;  // an old host: drivers split what is longer than 16 KiB
};

// Every driver must have closed its devices before it goes.
class UsbTestbed {
 public:
  explicit UsbTestbed(UsbTestbedOptions options = {});
  ~UsbTestbed();
  UsbTestbed(const UsbTestbed&) = delete;
  UsbTestbed& operator=(const UsbTestbed&) = delete;

  enum class Access { kAll, kNobody };
  // A camera that is plugged in again has the next device number. It starts as new.
  void plug(const std::shared_ptr<SimulatedCamera>& camera, Access access = Access::kAll);
  void unplug(const std::shared_ptr<SimulatedCamera>& camera);
  // When half of a frame has gone over the bus; false: none came, and it is still there.
  bool unplug_in_mid_frame(const std::shared_ptr<SimulatedCamera>& camera,
                           std::chrono::milliseconds patience = std::chrono::seconds(2));

  // Since it was plugged in, or until it was unplugged last.
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
