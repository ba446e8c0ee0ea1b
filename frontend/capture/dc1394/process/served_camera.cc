#include "frontend/capture/dc1394/process/served_camera.h"

#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <string_view>
#include <utility>

#include "frontend/capture/dc1394/process/iso_speed.h"
#include "frontend/capture/dc1394/process/library_log.h"
#include "frontend/capture/iidc/registers.h"
#include "proto/base/clock.h"

namespace relmap::iidc::dc1394 {

namespace {

constexpr int kFailures = 8;  // consecutive ones, after which the camera counts as gone

Status of_setup(dc1394error_t error) {
  switch (error) {
    case DC1394_NO_ISO_CHANNEL:
      return library_error(Reason::NO_BANDWIDTH, "the bus has no channel left");
    case DC1394_NO_BANDWIDTH:
      return library_error(Reason::NO_BANDWIDTH, "the bus has not the bandwidth left that the camera would use");
    case DC1394_MEMORY_ALLOCATION_FAILURE:
      return library_error(Reason::BUDGET_EXCEEDED, "libdc1394 has no memory for the frames");
    case DC1394_CAPTURE_IS_RUNNING:
      return {Reason::WRONG_STATE, "the camera's stream is received already"};
    default: {
      const std::string words = library_words();
      // libdc1394 gives no other sign that another program uses the stream.
      const Reason reason = words.find("claim interface") != std::string::npos ? Reason::CAMERA_BUSY : Reason::IO_ERROR;
      return {reason, "libdc1394 cannot receive the camera's stream: " +
                          (words.empty() ? std::string(dc1394_error_get_string(error)) : words)};
    }
  }
}

}  // namespace

Result<std::vector<std::uint64_t>> list_cameras(dc1394_t& library) {
  dc1394camera_list_t* list = nullptr;
  if (dc1394_camera_enumerate(&library, &list) != DC1394_SUCCESS || !list)
    return library_error(Reason::IO_ERROR, "libdc1394 cannot list the cameras");
  std::vector<std::uint64_t> guids;
  for (std::uint32_t i = 0; i < list->num; ++i)
    if (std::find(guids.begin(), guids.end(), list->ids[i].guid) == guids.end()) guids.push_back(list->ids[i].guid);
  dc1394_camera_free_list(list);
  return guids;
}

Result<std::unique_ptr<ServedCamera>> ServedCamera::open(std::uint64_t guid, bool usb_too, TellFunction tell) {
  Library library(dc1394_new());
  if (!library) return library_error(Reason::IO_ERROR, "libdc1394 finds neither IEEE 1394 nor USB");
  const auto guids = list_cameras(*library);
  if (!guids.ok()) return guids.status();
  const Status none(Reason::NO_CAMERA, "libdc1394 finds no such camera");
  if (std::find(guids->begin(), guids->end(), guid) == guids->end()) return none;
  dc1394camera_t* const camera = dc1394_camera_new(library.get(), guid);
  if (!camera) return library_error(Reason::IO_ERROR, "libdc1394 cannot open the camera");
  const char* platform = nullptr;
  const bool known = dc1394_camera_get_platform_string(camera, &platform) == DC1394_SUCCESS && platform;
  const bool on_usb = known && std::string_view(platform) == "usb";
  if (on_usb && !usb_too) return none;
  return std::unique_ptr<ServedCamera>(new ServedCamera(std::move(library), camera, on_usb, std::move(tell)));
}

std::string ServedCamera::place() const {
  std::uint32_t node = 0, generation = 0;
  (void)dc1394_camera_get_node(camera_, &node, &generation);
  return on_usb_ ? "USB bus " + std::to_string(generation) + ", device " + std::to_string(node)
                 : "node " + std::to_string(node & 0x3f);
}

Status ServedCamera::read(std::uint64_t address, std::span<std::uint32_t> quadlets) {
  for (std::size_t i = 0; i < quadlets.size(); ++i)  // one by one, since many cameras do not support block requests
    if (gone_ || dc1394_get_register(camera_, address + 4 * i - kRegisterSpace, &quadlets[i]) != DC1394_SUCCESS)
      return failed("reading", address + 4 * i);
  return {};
}

Status ServedCamera::write(std::uint64_t address, std::uint32_t quadlet) {
  if (gone_ || dc1394_set_register(camera_, address - kRegisterSpace, quadlet) != DC1394_SUCCESS)
    return failed("writing", address);
  return {};
}

// Determines whether the camera refused or has gone, by reading its ROM, which every camera allows.
Status ServedCamera::failed(const std::string& what, std::uint64_t address) {
  const std::string words = library_words();
  std::uint32_t quadlet = 0;
  if (!gone_ && dc1394_get_register(camera_, kConfigRom - kRegisterSpace, &quadlet) == DC1394_SUCCESS)
    return {Reason::IO_ERROR, what + " register " + address_text(address) +
                                  ": the camera refuses it, or did not answer" +
                                  (words.empty() ? "" : " (" + words + ")")};
  return {Reason::CAMERA_GONE, "the camera was unplugged, or answers no more"};
}

Status ServedCamera::start(std::shared_ptr<FrameRing> ring, std::size_t image_bytes) {
  if (ring_) return {Reason::WRONG_STATE, "the camera's stream is received already"};
  if (gone_) return {Reason::CAMERA_GONE, "the camera was unplugged, or answers no more"};
  if (!on_usb_)
    if (Status status = set_iso_speed(*camera_); !status.ok()) return status;
  const auto frames = static_cast<std::uint32_t>(std::clamp<std::size_t>(ring->slots(), 4, 16));
  (void)library_words();
  if (const auto error = dc1394_capture_setup(camera_, frames, DC1394_CAPTURE_FLAGS_DEFAULT); error != DC1394_SUCCESS)
    return of_setup(error);
  ring_ = std::move(ring);
  image_bytes_ = image_bytes;
  overrun_ = 0;
  wake_ = FileHandle(::eventfd(0, EFD_CLOEXEC));
  receiver_ = std::thread([this, frames = dc1394_capture_get_fileno(camera_)] { receive(frames); });
  return {};
}

void ServedCamera::stop() {
  if (!ring_) return;
  (void)::eventfd_write(wake_.get(), 1);
  receiver_.join();
  // If a camera has gone, libdc1394 frees memory that it still uses.
  if (!gone_) (void)dc1394_capture_stop(camera_);
  ring_.reset();
}

void ServedCamera::silence() {
  if (ring_ && !gone_) (void)dc1394_video_set_transmission(camera_, DC1394_OFF);
}

void ServedCamera::receive(int frames) {
  pollfd files[] = {{frames, POLLIN, 0}, {wake_.get(), POLLIN, 0}};
  int failures = 0;
  for (;;) {
    if (::poll(files, 2, -1) < 0) continue;
    if (files[1].revents != 0) return;
    dc1394video_frame_t* frame = nullptr;
    const auto error = dc1394_capture_dequeue(camera_, DC1394_CAPTURE_POLICY_POLL, &frame);
    if (!frame) {
      if (error != DC1394_SUCCESS || (files[0].revents & POLLIN) == 0)
        return tell_gone("libdc1394 receives no more of its frames");
      std::this_thread::sleep_for(std::chrono::milliseconds(1));  // of another event: it would be asked again at once
      continue;
    }
    if (error == DC1394_SUCCESS) pass_on(*frame);
    failures = error == DC1394_SUCCESS ? 0 : failures + 1;
    const std::string words = library_words();
    if (dc1394_capture_enqueue(camera_, frame) != DC1394_SUCCESS || failures == kFailures)
      return tell_gone("the camera was unplugged, or its stream is broken");
    if (error != DC1394_SUCCESS) (void)tell_(Message::fault({Reason::FRAME_DAMAGED, "a frame failed: " + words}));
  }
}

void ServedCamera::pass_on(const dc1394video_frame_t& frame) {
  const std::int64_t arrival_us = now_us();
  const auto bytes = static_cast<std::size_t>(frame.total_bytes);
  if (dc1394_capture_is_frame_corrupt(camera_, const_cast<dc1394video_frame_t*>(&frame))) {
    (void)tell_(Message::fault({Reason::SHORT_FRAME, "a frame of fewer than its " + std::to_string(bytes) + " bytes"}));
    return;
  }
  if (bytes < image_bytes_) {
    (void)tell_(Message::fault({Reason::SHORT_FRAME, "a frame of " + std::to_string(bytes) + " bytes instead of " +
                                                         std::to_string(image_bytes_)}));
    return;
  }
  const auto slot = ring_->take();
  if (!slot) {
    ++overrun_;
    return;
  }
  const std::size_t kept = std::min(bytes, ring_->frame_bytes());  // behind the pixels there is nothing to see
  std::memcpy(ring_->slot(*slot), frame.image, kept);
  if (tell_(Message::frame(*slot, kept, arrival_us, overrun_))) {
    overrun_ = 0;
  } else {
    ring_->give_back(*slot);
    ++overrun_;
  }
}

void ServedCamera::tell_gone(const std::string& what) {
  gone_ = true;
  (void)tell_(Message::fault(library_error(Reason::CAMERA_GONE, what)));
}

}  // namespace relmap::iidc::dc1394
