// A camera as libdc1394 reaches it.
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

// Of all cameras that libdc1394 finds now, on USB as well. IO_ERROR.
Result<std::vector<std::uint64_t>> list_cameras(dc1394_t& library);

// One thread calls it; frames and faults are told by another. It is never taken apart: libdc1394 does that badly where
// the camera has gone, and the end of its process does it well.
class ServedCamera {
 public:
  // False: it could not be told.
  using TellFunction = std::function<bool(const Message&)>;

  // NO_CAMERA; IO_ERROR: it is there and cannot be opened.
  static Result<std::unique_ptr<ServedCamera>> open(std::uint64_t guid, bool usb_too, TellFunction tell);

  std::string place() const;

  // CameraLink's reasons.
  Status read(std::uint64_t address, std::span<std::uint32_t> quadlets);
  Status write(std::uint64_t address, std::uint32_t quadlet);
  Status start(std::shared_ptr<FrameRing> ring, std::size_t image_bytes);
  void stop();
  // Where it is received: the camera is told to send no more.
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
  std::uint64_t overrun_ = 0;  // the receiver's: since the last frame that was told
};

}  // namespace relmap::iidc::dc1394
