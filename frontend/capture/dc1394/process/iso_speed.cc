#include "frontend/capture/dc1394/process/iso_speed.h"

#include <fcntl.h>
#include <linux/firewire-cdev.h>
#include <linux/firewire-constants.h>
#include <sys/ioctl.h>

#include <algorithm>

#include "frontend/capture/dc1394/file_handle.h"
#include "frontend/capture/dc1394/firewire_nodes.h"
#include "frontend/capture/dc1394/process/library_log.h"

namespace relmap::iidc::dc1394 {

namespace {

// The speed between this machine and the camera as measured by the kernel; 400 Mbit/s if the kernel does not say.
int path_speed(std::uint64_t guid) {
  const auto nodes = firewire_nodes();
  if (!nodes.ok()) return SCODE_400;
  for (const FirewireNode& node : *nodes)
    if (node.guid == guid) {
      const FileHandle file(::open(node.file.c_str(), O_RDWR | O_CLOEXEC));
      const int speed = file ? ::ioctl(file.get(), FW_CDEV_IOC_GET_SPEED) : -1;
      if (speed >= 0) return speed;
    }
  return SCODE_400;
}

}  // namespace

Status set_iso_speed(dc1394camera_t& camera) {
  const int path = path_speed(camera.guid);
  const bool fast = camera.bmode_capable && path >= SCODE_800;
  const auto speed =
      fast ? DC1394_ISO_SPEED_800 : static_cast<dc1394speed_t>(DC1394_ISO_SPEED_100 + std::min(path, SCODE_400));
  if (camera.bmode_capable &&
      dc1394_video_set_operation_mode(&camera, fast ? DC1394_OPERATION_MODE_1394B : DC1394_OPERATION_MODE_LEGACY) !=
          DC1394_SUCCESS)
    return library_error(Reason::IO_ERROR, "the camera's operation mode cannot be set");
  if (dc1394_video_set_iso_speed(&camera, speed) != DC1394_SUCCESS)
    return library_error(Reason::IO_ERROR, "the camera's speed cannot be set");
  return {};
}

}  // namespace relmap::iidc::dc1394
