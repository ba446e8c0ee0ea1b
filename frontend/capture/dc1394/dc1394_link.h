// A camera on IEEE 1394, served by a process of its own.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "frontend/capture/dc1394/camera_process.h"
#include "frontend/capture/dc1394/frame_ring.h"
#include "frontend/capture/dc1394/restart_pause.h"
#include "frontend/capture/iidc/camera_link.h"
#include "proto/base/mutex.h"

namespace relmap::iidc::dc1394 {

class Dc1394Link : public CameraLink, private ProcessEvents {
 public:
  explicit Dc1394Link(std::shared_ptr<RestartPause> pause) : pause_(std::move(pause)) {}

  // Must be called once, before all other functions. The reasons of CameraProcess::start() and CameraBus::open().
  Status open(const std::string& program, const std::vector<std::string>& arguments, std::uint64_t guid);
  // The same with a process that is already running, for tests.
  Status open_at(FileHandle socket, std::uint64_t guid);
  // Where the camera is on the bus, in the words of libdc1394's process ("node 1"); empty before open().
  const std::string& place() const { return place_; }

  Status read(std::uint64_t address, std::span<std::uint32_t> quadlets) override;
  Status write(std::uint64_t address, std::uint32_t quadlet) override;
  Status start(const StreamRequest& request) override;
  Status claim() override { return {}; }
  Result<RawFrame> next(std::chrono::milliseconds wait) override;
  void stop() override;

 private:
  struct Arrival {
    Status status;  // not ok if the frame is lost; otherwise:
    RawFrame frame;
  };

  Status told(const Message& message) override;
  void ended(const Status& why) override;
  Status open(Result<std::unique_ptr<CameraProcess>> process, std::uint64_t guid);
  Status queue_frame(const Message& message) RELMAP_REQUIRES(mutex_);
  void drop_oldest() RELMAP_REQUIRES(mutex_);

  const std::shared_ptr<RestartPause> pause_;
  std::string place_;

  Mutex mutex_;
  ConditionVariable news_;
  std::shared_ptr<FrameRing> ring_ RELMAP_GUARDED_BY(mutex_);  // of the current stream
  std::size_t image_bytes_ RELMAP_GUARDED_BY(mutex_) = 0;
  std::deque<Arrival> arrivals_ RELMAP_GUARDED_BY(mutex_);
  std::uint64_t overrun_ RELMAP_GUARDED_BY(mutex_) = 0;  // since the last frame that was queued
  Status gone_ RELMAP_GUARDED_BY(mutex_);

  std::unique_ptr<CameraProcess> process_;  // last, so that it is destroyed first: it calls told() and ended()
};

}  // namespace relmap::iidc::dc1394
