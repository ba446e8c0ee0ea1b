// A camera as accessed by libdc1394.
#pragma once

#include <dc1394/dc1394.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "frontend/capture/dc1394/file_handle.h"
#include "frontend/capture/dc1394/frame_ring.h"
#include "frontend/capture/dc1394/protocol.h"
#include "proto/base/status.h"

namespace relmap::iidc::dc1394 {

struct LibraryDeleter {
  void operator()(dc1394_t* library) const { dc1394_free(library); }
};
using Library = std::unique_ptr<dc1394_t, LibraryDeleter>;

// The GUIDs of all cameras that libdc1394 finds now, also on USB. IO_ERROR.
Result<std::vector<std::uint64_t>> list_cameras(dc1394_t& library);

// Must be called by one thread; frames and faults are sent by another. Resources are left to the end of the process,
// since libdc1394 does not release them safely when the camera has gone.
class ServedCamera {
 public:
  // Sends a message; returns false if that failed.
  using TellFunction = std::function<bool(const Message&)>;

  // NO_CAMERA; IO_ERROR if the camera exists but cannot be opened.
  static Result<std::unique_ptr<ServedCamera>> open(std::uint64_t guid, bool usb_too, TellFunction tell);

  std::string place() const;

  // The reasons of CameraLink.
  Status read(std::uint64_t address, std::span<std::uint32_t> quadlets);
  Status write(std::uint64_t address, std::uint32_t quadlet);
  Status start(std::shared_ptr<FrameRing> ring, std::size_t image_bytes);
  void stop();
  // Tells the camera to stop sending, if a stream is being received.
  void silence();

 private:
  ServedCamera(Library library, dc1394camera_t* camera, bool on_usb, TellFunction tell)
      : library_(std::move(library)), camera_(camera), on_usb_(on_usb), tell_(std::move(tell)) {}

  Status failed(const std::string& what, std::uint64_t address);
  void receive(int frames);
  void pass_on(const dc1394video_frame_t& frame);
  void tell_gone(const std::string& what);

  const Library library_;
  dc1394camera_t* const camera_;
  const bool on_usb_;
  const TellFunction tell_;
  std::atomic<bool> gone_ = false;

  std::shared_ptr<FrameRing> ring_;
  std::size_t image_bytes_ = 0;
  FileHandle wake_;
  std::thread receiver_;
  std::uint64_t overrun_ = 0;  // used by the receiver: frames dropped since the last one that was sent
};

}  // namespace relmap::iidc::dc1394
