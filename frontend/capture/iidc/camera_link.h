// A camera at the end of a bus, whatever the bus: its registers, and the frames that it sends.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "proto/base/status.h"

namespace relmap::iidc {

// What a camera is known by before it is opened.
struct CameraAddress {
  std::uint64_t guid = 0;  // of its configuration ROM: the same on every bus and port; 0: could not be read
  std::string serial;      // the maker's number where it can be read, else the GUID in hexadecimal
  std::string vendor, model;
  std::string bus;     // "usb", "1394"
  std::string place;   // where it hangs, for people: "bus 1, device 4"
  Status usable = {};  // why it cannot be opened by us: CAMERA_FORBIDDEN, CAMERA_BUSY, CORRUPT (its ROM), ...
};

struct StreamRequest {
  std::size_t frame_bytes = 0;  // of a frame as it is sent, with what fills its last packet
  std::size_t image_bytes = 0;  // of its pixels: no frame has fewer
  std::size_t buffers = 8;      // frames in flight and complete, together; at least 3
};

// A frame as it came. Its memory goes back to the stream with the last copy of `data`, which may outlive the link.
struct RawFrame {
  std::shared_ptr<const std::uint8_t> data;
  std::size_t size = 0;
  std::int64_t arrival_us = 0;  // UTC, when its last byte had come
  std::chrono::steady_clock::time_point arrived{};
  std::uint64_t overrun = 0;  // frames given up just before it because nobody took them

  std::span<const std::uint8_t> bytes() const { return {data.get(), size}; }
};

// Registers may be read and written by any thread, also while frames come; start(), next() and stop() by one at a time.
class CameraLink {
 public:
  virtual ~CameraLink() = default;

  // Quadlets of the camera's 48 bits of address space, in the host's byte order. CAMERA_GONE; IO_ERROR: the camera
  // refused (an address that it does not have) or did not answer, with the address.
  virtual Status read(std::uint64_t address, std::span<std::uint32_t> quadlets) = 0;
  virtual Status write(std::uint64_t address, std::uint32_t quadlet) = 0;

  // From now on the camera is this link's to set up and to stream from, until it goes: who only wants to see a register
  // needs it not. CAMERA_BUSY, CAMERA_GONE. Over IEEE 1394 nobody can tell.
  virtual Status claim() = 0;

  // Makes ready to receive; the camera is told to send afterwards, by its registers. CAMERA_GONE, CAMERA_BUSY: another
  // program has its stream; NO_BANDWIDTH; BUDGET_EXCEEDED: no memory for the buffers; WRONG_STATE: is started already.
  virtual Status start(const StreamRequest& request) = 0;

  // The oldest frame that is complete. Otherwise: CAMERA_SILENT (none within `wait`), SHORT_FRAME, FRAME_DAMAGED (too
  // much came, or a transfer failed), CAMERA_STALLED (the endpoint was halted; it was cleared): one frame is lost and
  // the next call goes on. CAMERA_GONE: unplugged, or the bus's process has ended; the link is of no use any more.
  virtual Result<RawFrame> next(std::chrono::milliseconds wait) = 0;

  // Frames not taken are dropped. Nothing where it is not started.
  virtual void stop() = 0;
};

// Thread-safe.
class CameraBus {
 public:
  virtual ~CameraBus() = default;

  virtual std::string name() const = 0;  // as CameraAddress::bus
  // All cameras there, those too that cannot be opened. UNSUPPORTED: no such bus in this machine, and why.
  virtual Result<std::vector<CameraAddress>> cameras() = 0;
  // NO_CAMERA, CAMERA_BUSY, CAMERA_FORBIDDEN (with what to do), CAMERA_GONE (meanwhile).
  virtual Result<std::unique_ptr<CameraLink>> open(std::uint64_t guid) = 0;
  // Returns true when a device has come or gone since the call before, false when `wait` is over.
  virtual bool wait_for_change(std::chrono::milliseconds wait) = 0;
};

}  // namespace relmap::iidc
