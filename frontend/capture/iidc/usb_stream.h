// The frames of a camera on USB: bulk transfers of one frame each, which are submitted again as soon as they complete.
#pragma once

#include <libusb.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "frontend/capture/iidc/camera_link.h"
#include "frontend/capture/iidc/frame_pool.h"
#include "proto/base/mutex.h"

namespace relmap::iidc {

// Callbacks run on the thread that handles libusb's events; all functions must be called by one thread at a time.
class UsbStream {
 public:
  // The interface must be claimed. The reasons of CameraLink::start().
  static Result<std::unique_ptr<UsbStream>> start(libusb_device_handle* handle, std::uint8_t endpoint,
                                                  const StreamRequest& request);
  // Cancels all transfers. Returns false if one did not complete within two seconds; the stream must then not be
  // destroyed.
  bool stop();
  ~UsbStream();

  Result<RawFrame> next(std::chrono::milliseconds wait);

 private:
  struct Transfer {
    UsbStream* stream = nullptr;
    libusb_transfer* usb = nullptr;
    FramePool::Buffer buffer;
    bool flying = false;
  };
  struct Arrival {
    Status status;  // not ok if the frame is lost; otherwise:
    FramePool::Buffer buffer;
    std::size_t size = 0;
    std::int64_t arrival_us = 0;
    std::chrono::steady_clock::time_point arrived{};
    std::uint64_t overrun = 0;
  };

  UsbStream(libusb_device_handle* handle, std::uint8_t endpoint, std::size_t frame_bytes, std::size_t image_bytes)
      : handle_(handle), endpoint_(endpoint), frame_bytes_(frame_bytes), image_bytes_(image_bytes) {}
  static void LIBUSB_CALL done(libusb_transfer* usb);
  void take(Transfer& transfer);
  void lose(Reason reason, std::string message) RELMAP_REQUIRES(mutex_);
  Status submit(Transfer& transfer) RELMAP_REQUIRES(mutex_);
  bool all_home() RELMAP_REQUIRES(mutex_);
  Status recover() RELMAP_REQUIRES(mutex_);

  libusb_device_handle* const handle_;
  const std::uint8_t endpoint_;
  const std::size_t frame_bytes_, image_bytes_;
  std::shared_ptr<FramePool> pool_;
  std::vector<std::unique_ptr<Transfer>> transfers_;

  Mutex mutex_;
  ConditionVariable news_;
  std::deque<Arrival> arrivals_ RELMAP_GUARDED_BY(mutex_);
  std::size_t flying_ RELMAP_GUARDED_BY(mutex_) = 0;
  std::uint64_t overrun_ RELMAP_GUARDED_BY(mutex_) = 0;  // since the last frame that was queued
  int failures_ RELMAP_GUARDED_BY(mutex_) = 0;           // consecutive
  bool babbled_ RELMAP_GUARDED_BY(mutex_) = false;  // the next short transfer is the end of a frame that was too long
  bool stopping_ RELMAP_GUARDED_BY(mutex_) = false;
  bool halted_ RELMAP_GUARDED_BY(mutex_) = false;  // no transfer is submitted until recover()
  bool gone_ RELMAP_GUARDED_BY(mutex_) = false;
};

}  // namespace relmap::iidc
