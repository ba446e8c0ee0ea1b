#include "frontend/capture/iidc/usb_stream.h"

#include <algorithm>
#include <string>
#include <utility>

#include "proto/base/clock.h"
#include "proto/base/mutex.h"

namespace relmap::iidc {

namespace {

constexpr std::chrono::seconds kHome{2};  // for cancelled transfers to complete
constexpr int kFailures = 8;              // consecutive ones, before the endpoint is reset
constexpr std::size_t kMaxFaults = 64;    // that wait to be reported

Status of_submit(int error) {
  switch (error) {
    case LIBUSB_ERROR_NO_DEVICE:
      return {Reason::CAMERA_GONE, "the camera was unplugged"};
    case LIBUSB_ERROR_NO_MEM:
      return {Reason::NO_BANDWIDTH,
              "the kernel has no memory or bandwidth for the transfers (usbcore.usbfs_memory_mb raises the first)"};
    case LIBUSB_ERROR_BUSY:
      return {Reason::CAMERA_BUSY, "the camera's stream is in use"};
    default:
      return {Reason::NO_BANDWIDTH, std::string("transfers cannot be begun: ") + libusb_error_name(error)};
  }
}

}  // namespace

Result<std::unique_ptr<UsbStream>> UsbStream::start(libusb_device_handle* handle, std::uint8_t endpoint,
                                                    const StreamRequest& request) {
  // USB 3 has its own packets, and the padding of the last 1394 packet is not sent.
  const bool pads = libusb_get_device_speed(libusb_get_device(handle)) < LIBUSB_SPEED_SUPER;
  const std::size_t frame_bytes = pads ? request.frame_bytes : request.image_bytes;
  std::unique_ptr<UsbStream> stream(new UsbStream(handle, endpoint, frame_bytes, request.image_bytes));
  const std::size_t buffers = std::max<std::size_t>(3, request.buffers), in_flight = buffers / 2;
  stream->pool_ = FramePool::make(buffers, frame_bytes);
  if (!stream->pool_)
    return {Reason::BUDGET_EXCEEDED,
            "no memory for " + std::to_string(buffers) + " frames of " + std::to_string(frame_bytes) + " bytes"};
  for (std::size_t i = 0; i < std::max<std::size_t>(2, in_flight); ++i) {
    auto transfer = std::make_unique<Transfer>();
    transfer->stream = stream.get();
    transfer->usb = libusb_alloc_transfer(0);
    if (!transfer->usb) return {Reason::BUDGET_EXCEEDED, "no memory for a transfer"};
    transfer->buffer = stream->pool_->take();
    stream->transfers_.push_back(std::move(transfer));
  }
  Status status;
  {
    const MutexLock lock(stream->mutex_);
    for (auto& transfer : stream->transfers_)
      if (status = stream->submit(*transfer); !status.ok()) break;
  }
  if (status.ok()) return stream;
  if (!stream->stop()) (void)stream.release();
  return status;
}

bool UsbStream::all_home() {
  for (auto& transfer : transfers_)
    if (transfer->flying) libusb_cancel_transfer(transfer->usb);
  return news_.wait_for(mutex_, kHome, [this]() RELMAP_REQUIRES(mutex_) { return flying_ == 0; });
}

bool UsbStream::stop() {
  MutexLock lock(mutex_);
  stopping_ = true;
  return all_home();
}

UsbStream::~UsbStream() {
  for (auto& transfer : transfers_) libusb_free_transfer(transfer->usb);
}

Status UsbStream::submit(Transfer& transfer) {
  libusb_fill_bulk_transfer(transfer.usb, handle_, endpoint_, transfer.buffer.get(), static_cast<int>(frame_bytes_),
                            &UsbStream::done, &transfer, 0);
  if (const int error = libusb_submit_transfer(transfer.usb); error != LIBUSB_SUCCESS) return of_submit(error);
  transfer.flying = true;
  ++flying_;
  return {};
}

void UsbStream::done(libusb_transfer* usb) {
  auto& transfer = *static_cast<Transfer*>(usb->user_data);
  transfer.stream->take(transfer);
}

void UsbStream::lose(Reason reason, std::string message) {
  if (arrivals_.size() < kMaxFaults + transfers_.size()) arrivals_.push_back({Status(reason, std::move(message)), {}});
}

void UsbStream::take(Transfer& transfer) {
  const std::int64_t arrival_us = now_us();
  const auto arrived = std::chrono::steady_clock::now();
  const MutexLock lock(mutex_);
  transfer.flying = false;
  --flying_;
  const auto length = static_cast<std::size_t>(transfer.usb->actual_length);
  switch (stopping_ ? LIBUSB_TRANSFER_CANCELLED : transfer.usb->status) {
    case LIBUSB_TRANSFER_COMPLETED:
      failures_ = 0;
      if (length < image_bytes_) {
        // An empty transfer between two frames is no frame.
        if (length > 0 && !std::exchange(babbled_, false))
          lose(Reason::SHORT_FRAME,
               "a frame of " + std::to_string(length) + " bytes instead of " + std::to_string(image_bytes_));
        break;
      }
      babbled_ = false;
      if (FramePool::Buffer other = pool_->take()) {
        arrivals_.push_back({Status(), std::exchange(transfer.buffer, std::move(other)), length, arrival_us, arrived,
                             std::exchange(overrun_, 0)});
      } else if (const auto oldest = std::find_if(arrivals_.begin(), arrivals_.end(),
                                                  [](const Arrival& arrival) { return arrival.status.ok(); });
                 oldest != arrivals_.end()) {
        // Frames were not taken in time: drop the oldest.
        FramePool::Buffer freed = std::move(oldest->buffer);
        const std::uint64_t lost = oldest->overrun + 1;
        const auto after = arrivals_.erase(oldest);
        const auto heir = std::find_if(after, arrivals_.end(), [](const Arrival& a) { return a.status.ok(); });
        if (heir != arrivals_.end())
          heir->overrun += lost;
        else
          overrun_ += lost;
        arrivals_.push_back({Status(), std::exchange(transfer.buffer, std::move(freed)), length, arrival_us, arrived,
                             std::exchange(overrun_, 0)});
      } else {
        ++overrun_;  // all buffers are lent
      }
      break;
    case LIBUSB_TRANSFER_OVERFLOW:
      babbled_ = true;
      lose(Reason::FRAME_DAMAGED, "more came than the " + std::to_string(frame_bytes_) + " bytes of a frame");
      break;
    case LIBUSB_TRANSFER_STALL:
      if (!halted_) lose(Reason::CAMERA_STALLED, "the camera halted its stream; it was set going again");
      halted_ = true;
      break;
    case LIBUSB_TRANSFER_NO_DEVICE:
      gone_ = true;
      break;
    case LIBUSB_TRANSFER_CANCELLED:
      break;
    default:
      lose(Reason::FRAME_DAMAGED, "a transfer failed after " + std::to_string(length) + " bytes");
      if (++failures_ >= kFailures) halted_ = true;
      break;
  }
  if (!stopping_ && !halted_ && !gone_)
    if (Status status = submit(transfer); !status.ok()) {
      if (status.reason() == Reason::CAMERA_GONE)
        gone_ = true;
      else
        lose(status.reason(), status.message()), halted_ = true;
    }
  news_.notify_all();
}

// Completes all transfers, clears the halt, and submits them again.
Status UsbStream::recover() {
  if (!all_home()) gone_ = true;
  if (gone_) return {};
  mutex_.unlock();
  const int cleared = libusb_clear_halt(handle_, endpoint_);
  mutex_.lock();

  if (cleared == LIBUSB_ERROR_NO_DEVICE) {
    gone_ = true;
    return {};
  }
  if (cleared != LIBUSB_SUCCESS)
    return {Reason::IO_ERROR, std::string("the halt of the stream cannot be cleared: ") + libusb_error_name(cleared)};
  halted_ = false;
  failures_ = 0;
  for (auto& transfer : transfers_)
    if (Status status = submit(*transfer); !status.ok()) {
      gone_ = status.reason() == Reason::CAMERA_GONE;
      halted_ = true;
      return gone_ ? Status() : status;
    }
  return {};
}

Result<RawFrame> UsbStream::next(std::chrono::milliseconds wait) {
  const auto until = std::chrono::steady_clock::now() + wait;
  MutexLock lock(mutex_);
  for (;;) {
    if (halted_ && !gone_)
      if (Status status = recover(); !status.ok()) {
        news_.wait_until(mutex_, until, [this]() RELMAP_REQUIRES(mutex_) { return gone_; });  // not again at once
        return status;
      }
    if (!arrivals_.empty()) {
      Arrival arrival = std::move(arrivals_.front());
      arrivals_.pop_front();
      if (!arrival.status.ok()) return arrival.status;
      return RawFrame{pool_->lend(std::move(arrival.buffer)), arrival.size, arrival.arrival_us, arrival.arrived,
                      arrival.overrun};
    }
    if (gone_) return {Reason::CAMERA_GONE, "the camera was unplugged"};
    if (!news_.wait_until(mutex_, until,
                          [this]() RELMAP_REQUIRES(mutex_) { return !arrivals_.empty() || halted_ || gone_; }))
      return {Reason::CAMERA_SILENT, "no frame within " + std::to_string(wait.count()) + " ms"};
  }
}

}  // namespace relmap::iidc
