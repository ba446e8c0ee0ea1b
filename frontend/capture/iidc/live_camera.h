// A camera that streams, and goes on streaming: whatever happens to it is named, counted and recovered from.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "frontend/capture/iidc/camera_link.h"
#include "frontend/capture/iidc/config_rom.h"
#include "frontend/capture/iidc/cycle_clock.h"
#include "frontend/capture/iidc/features.h"
#include "frontend/capture/iidc/identity.h"
#include "frontend/capture/iidc/video_mode.h"
#include "proto/base/status.h"

namespace relmap::iidc {

struct LiveOptions {
  std::string serial;  // or GUID; empty: the only camera there is
  StreamWish wish;
  std::vector<FeatureSetting> features;   // set whenever the camera is opened
  std::optional<TriggerSetting> trigger;  // else as it is
  std::vector<StrobeSetting> strobes;
  std::size_t buffers = 8;
  std::chrono::milliseconds silence{
      1000};  // without a frame, before the stream is begun anew; rates below ask for more
};

struct LiveFrame {
  RawFrame raw;                        // without what fills its last packet
  std::int64_t time_us = 0;            // UTC: of the exposure's beginning where the camera stamps its frames, else of
                                       // the last byte's arrival
  std::uint64_t index = 0;             // among the frames that the camera took, by its counter where it has one
  std::optional<std::uint32_t> cycle;  // the camera's own stamp
  std::chrono::steady_clock::time_point arrived;
};

struct LiveCounts {
  std::uint64_t frames = 0;
  std::uint64_t lost = 0;  // frames that the camera took and that never came, or came damaged
  std::map<Reason, std::uint64_t> faults;
  std::uint64_t reopened = 0;       // after it had gone
  std::uint64_t begun_anew = 0;     // the stream, the camera being there
  std::optional<double> drift_ppm;  // of the camera's clock against the host's
};

// Not thread-safe but for its counts.
class LiveCamera {
 public:
  // Finds it, sets it up and lets it send. `stop`, set by any thread, ends next() within a tenth of a second. Reasons:
  // choose_camera()'s, set_stream()'s, set_feature()'s, CameraLink::start()'s.
  static Result<std::unique_ptr<LiveCamera>> open(std::vector<std::shared_ptr<CameraBus>> buses,
                                                  const LiveOptions& options, const std::atomic<bool>& stop);
  ~LiveCamera();

  const CameraAddress& address() const { return camera_.address; }
  const StreamFormat& format() const { return format_; }
  bool stamped() const { return embeds_; }  // by the camera

  // Waits for the next frame; nothing: it is to stop. An error is a gap, of a frame or of as long as it lasts, and the
  // call after it goes on: SHORT_FRAME, FRAME_DAMAGED, CAMERA_STALLED, CAMERA_SILENT; CAPTURE_FAILED: frames are
  // missing (the message tells how many, and whether they were never sent or not taken in time); CAMERA_GONE: it is
  // waited for, and what stands in the way when it is there again (CAMERA_BUSY, REGISTER_REFUSED, ...) is told when it
  // changes.
  Result<std::optional<LiveFrame>> next();

  LiveCounts counts() const;

 private:
  LiveCamera(std::vector<std::shared_ptr<CameraBus>> buses, LiveOptions options, const std::atomic<bool>& stop)
      : buses_(std::move(buses)), options_(std::move(options)), stop_(stop) {}

  Status set_up();  // the link is open
  Status set_up_exposure();
  Status begin();  // lets it send
  Status begin_anew();
  // After a while without a good frame the stream is begun anew; where that does not help, the camera is opened anew.
  // How long that was, if it was done.
  std::optional<std::chrono::milliseconds> help();
  std::optional<Status> come_back();  // nothing: it has, or it is to stop
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
  int bad_heads_ = 0;   // frames whose stamps cannot be so, since ten good ones in a row
  int good_heads_ = 0;  // in a row
  bool waits_for_trigger_ = false;
  double interval_s_ = 0;                        // of frames, at most; 0: not known
  std::optional<std::uint64_t> cycle_register_;  // address
  CycleClock clock_;
  std::chrono::milliseconds clock_pause_{};
  std::chrono::steady_clock::time_point clock_read_{}, last_frame_{}, next_try_{}, obstacle_since_{};
  std::int64_t utc_of_host_us_ = 0, last_time_us_ = 0;
  int fruitless_ = 0;  // times that the stream was begun anew since the last good frame
  bool fresh_ = true;  // no frame has come since it was begun
  std::optional<std::uint32_t> last_counter_;
  std::uint64_t index_ = 0;
  std::uint64_t told_ = 0;         // frames lost since the last one that came, each told as a fault of its own
  std::optional<LiveFrame> kept_;  // the frame behind a gap that was just told
  Reason obstacle_ = Reason::OK;   // that stands in the way now
  bool obstacle_told_ = false;

  mutable std::mutex mutex_;  // of counts_
  LiveCounts counts_;
};

}  // namespace relmap::iidc
