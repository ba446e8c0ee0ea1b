// A camera that streams continuously: faults are named, counted and recovered from.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "frontend/capture/iidc/camera_link.h"
#include "frontend/capture/iidc/config_rom.h"
#include "frontend/capture/iidc/cycle_clock.h"
#include "frontend/capture/iidc/features.h"
#include "frontend/capture/iidc/identity.h"
#include "frontend/capture/iidc/video_mode.h"
#include "proto/base/mutex.h"
#include "proto/base/status.h"

namespace relmap::iidc {

struct LiveOptions {
  std::string serial;  // or GUID; empty if there is only one camera
  StreamWish wish;
  std::vector<FeatureSetting> features;   // set whenever the camera is opened
  std::optional<TriggerSetting> trigger;  // not changed if not set
  std::vector<StrobeSetting> strobes;
  std::size_t buffers = 8;
  // The stream is restarted after this time without a frame, or a longer one at low frame rates.
  std::chrono::milliseconds silence{1000};
};

struct LiveFrame {
  RawFrame raw;  // without the padding of its last packet
  // UTC: start of the exposure if the camera stamps its frames, otherwise arrival of the last byte.
  std::int64_t time_us = 0;
  std::uint64_t index = 0;             // among the frames that the camera took, by its counter if it has one
  std::optional<std::uint32_t> cycle;  // the camera's own stamp
  std::chrono::steady_clock::time_point arrived;
};

struct LiveCounts {
  std::uint64_t frames = 0;
  // Frames that the camera took and that did not arrive, arrived damaged, or were not taken in time. Those that did not
  // arrive before the first that did are not known.
  std::uint64_t lost = 0;
  std::map<Reason, std::uint64_t> faults;
  std::uint64_t reopened = 0;       // times that the camera was opened again after it had gone
  std::uint64_t begun_anew = 0;     // times that the stream was restarted while the camera was there
  std::optional<double> drift_ppm;  // of the camera's clock relative to the host's
};

// Not thread-safe, except for counts().
class LiveCamera {
 public:
  // Finds a camera, sets it up and starts its stream. `stop`, set by any thread, ends next() within a tenth of a
  // second. The reasons of choose_camera(), set_stream(), set_feature() and CameraLink::start().
  static Result<std::unique_ptr<LiveCamera>> open(std::vector<std::shared_ptr<CameraBus>> buses,
                                                  const LiveOptions& options, const std::atomic<bool>& stop);
  ~LiveCamera();

  const CameraAddress& address() const { return camera_.address; }
  const StreamFormat& format() const { return format_; }
  bool stamped() const { return embeds_; }  // whether the camera stamps its frames

  // Waits for the next frame; nothing after `stop`. An error is a gap of one or more frames, and the next call
  // continues: SHORT_FRAME, FRAME_DAMAGED, CAMERA_STALLED, CAMERA_SILENT; CAPTURE_FAILED if frames are missing (the
  // message says how many, and whether they were never sent or not taken in time); CAMERA_GONE, after which the next
  // calls wait for the camera. What prevents opening it again (CAMERA_BUSY, REGISTER_REFUSED, ...) is returned whenever
  // it changes.
  Result<std::optional<LiveFrame>> next();

  LiveCounts counts() const;

 private:
  LiveCamera(std::vector<std::shared_ptr<CameraBus>> buses, LiveOptions options, const std::atomic<bool>& stop)
      : buses_(std::move(buses)), options_(std::move(options)), stop_(stop) {}

  Status set_up();  // requires an open link
  Status set_up_exposure();
  Status begin();  // starts the stream
  Status begin_anew();
  // After some time without a good frame restarts the stream or, if that did not help, opens the camera again. Returns
  // that time if it did so.
  std::optional<std::chrono::milliseconds> help();
  std::optional<Status> come_back();  // waits for a camera that has gone; nothing if it is back, or after `stop`
  void close();
  Status fault(Status status);
  std::optional<LiveFrame> made(RawFrame raw, Status& gap);
  void read_clock();
  std::int64_t time_of(const LiveFrame& frame) const;

  const std::vector<std::shared_ptr<CameraBus>> buses_;
  const LiveOptions options_;
  const std::atomic<bool>& stop_;
  FoundCamera camera_;
  std::unique_ptr<CameraLink> link_;
  std::optional<RegisterFile> registers_;
  StreamFormat format_;
  bool embeds_ = false;
  int bad_heads_ = 0;   // frames with invalid stamps since ten consecutive good ones
  int good_heads_ = 0;  // consecutive
  bool waits_for_trigger_ = false;
  double interval_s_ = 0;                        // maximum time between frames; 0 if not known
  std::optional<std::uint64_t> cycle_register_;  // its address
  CycleClock clock_;
  std::chrono::milliseconds clock_pause_{};
  std::chrono::steady_clock::time_point clock_read_{}, last_frame_{}, next_try_{}, obstacle_since_{};
  std::int64_t utc_of_host_us_ = 0, last_time_us_ = 0;
  int fruitless_ = 0;  // times that the stream was restarted since the last good frame
  bool fresh_ = true;  // no frame has arrived since the stream was started
  std::optional<std::uint32_t> last_counter_;
  std::uint64_t index_ = 0;
  std::uint64_t told_ = 0;         // frames lost since the last one that arrived, each reported as a fault of its own
  bool halted_ = false;            // the stream was halted, and no frame has arrived since
  std::optional<LiveFrame> kept_;  // the frame after a gap that was just reported
  Reason obstacle_ = Reason::OK;   // what prevents opening the camera now
  bool obstacle_told_ = false;

  mutable Mutex mutex_;
  LiveCounts counts_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::iidc
