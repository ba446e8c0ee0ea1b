// The interfaces of a bus and of a camera on it, independent of the kind of bus: registers and frames.
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

// What is known of a camera before it is opened.
struct CameraAddress {
  std::uint64_t guid = 0;  // from its configuration ROM, the same on every bus and port; 0 if it could not be read
  std::string serial;      // the maker's number if it can be read, otherwise the GUID in hexadecimal
  std::string vendor, model;
  std::string bus;     // "usb", "1394"
  std::string place;   // where it is plugged in, for display: "bus 1, device 4"
  Status usable = {};  // why it cannot be opened: CAMERA_FORBIDDEN, CAMERA_BUSY, CORRUPT (its ROM), ...
};

struct StreamRequest {
  std::size_t frame_bytes = 0;  // size of a frame as it is sent, with the padding of its last packet
  std::size_t image_bytes = 0;  // size of its pixels, the minimum size of a frame
  std::size_t buffers = 8;      // number of frames that are in flight or complete; at least 3
};

// A frame as it arrived. Its memory returns to the stream with the last copy of `data`, which may outlive the link.
struct RawFrame {
  std::shared_ptr<const std::uint8_t> data;
  std::size_t size = 0;
  std::int64_t arrival_us = 0;  // UTC, when its last byte had arrived
  std::chrono::steady_clock::time_point arrived{};
  std::uint64_t overrun = 0;  // number of frames dropped just before it, because they were not taken in time

  std::span<const std::uint8_t> bytes() const { return {data.get(), size}; }
};

// Registers may be read and written by any thread, also while frames arrive. start(), next() and stop() must be called
// by one thread at a time.
class CameraLink {
 public:
  virtual ~CameraLink() = default;

  // Read and write quadlets of the camera's 48-bit address space, in the host's byte order. CAMERA_GONE; IO_ERROR, with
  // the address, if the camera refused (it does not have that address) or did not answer.
  virtual Status read(std::uint64_t address, std::span<std::uint32_t> quadlets) = 0;
  virtual Status write(std::uint64_t address, std::uint32_t quadlet) = 0;

  // Reserves the camera for this link, to set it up and stream from it, until the link is destroyed. Reading registers
  // does not need it. CAMERA_BUSY, CAMERA_GONE. Over IEEE 1394 a conflict cannot be detected.
  virtual Status claim() = 0;

  // Prepares to receive. The camera must then be told to send, by its registers. CAMERA_GONE; CAMERA_BUSY if another
  // program uses its stream; NO_BANDWIDTH; BUDGET_EXCEEDED if there is no memory for the buffers; WRONG_STATE if the
  // stream is started already.
  virtual Status start(const StreamRequest& request) = 0;

  // Returns the oldest complete frame. One frame is lost, and the next call continues, with SHORT_FRAME, FRAME_DAMAGED
  // (too many bytes arrived, or a transfer failed) and CAMERA_STALLED (the endpoint was halted, and was cleared).
  // CAMERA_SILENT if no frame arrived within `wait`. CAMERA_GONE if the camera was unplugged or the process of the bus
  // has ended; the link is then unusable.
  virtual Result<RawFrame> next(std::chrono::milliseconds wait) = 0;

  // Ends the stream and drops frames that were not taken. Does nothing if it is not started.
  virtual void stop() = 0;
};

// Thread-safe.
class CameraBus {
 public:
  virtual ~CameraBus() = default;

  virtual std::string name() const = 0;  // as in CameraAddress::bus
  // Lists all cameras, including those that cannot be opened. UNSUPPORTED if this machine has no such bus, with the
  // cause.
  virtual Result<std::vector<CameraAddress>> cameras() = 0;
  // NO_CAMERA, CAMERA_BUSY, CAMERA_FORBIDDEN (with what to do), CAMERA_GONE (since it was listed).
  virtual Result<std::unique_ptr<CameraLink>> open(std::uint64_t guid) = 0;
  // Waits for a device to be plugged in or out since the call before; returns false after `wait`.
  virtual bool wait_for_change(std::chrono::milliseconds wait) = 0;
};

}  // namespace relmap::iidc
