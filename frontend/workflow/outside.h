// What a run uses outside its own process: the daemon, recordings, logs and cameras. Tests replace these with fakes.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "frontend/capture/iidc/iidc_source.h"
#include "frontend/capture/stereo_source.h"
#include "frontend/publishing/publisher.h"
#include "frontend/recording/recorded_sessions.h"
#include "frontend/sink.h"
#include "frontend/workflow/run_options.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::workflow {

// Returns the next keyframe; nullopt at the end.
using NextKeyframe = std::function<Result<std::optional<Keyframe>>()>;

// Reads logs of keyframes that robots published. Logs consist of LCM messages, which not every build can read; by
// default no file is a log.
struct Logs {
  struct Session {
    SessionHeader header;
    NextKeyframe next;
    std::function<std::map<Reason, std::uint64_t>()> left_out;  // KeyframeLog::left_out()
  };
  std::function<bool(const std::string& path)> is_log = [](const std::string&) { return false; };
  // `choice` is that of KeyframeLog::open().
  std::function<Result<Session>(const std::string& path, const std::string& choice)> open = {};
  std::function<Result<std::vector<recording::RecordedSession>>(const std::string& path)> list = {};
};

// Opens a camera. May be called again if the camera was not available.
using OpenCamera =
    std::function<Result<std::unique_ptr<iidc::IidcSource>>(const iidc::IidcOptions&, const std::atomic<bool>& stop)>;

// Calls capture::open_source() for the path in the options.
Result<std::unique_ptr<capture::StereoSource>> open_recording(const RunOptions& options);
// Opens the buses named `bus` and returns what opens cameras on them. The reasons of open_camera_buses().
Result<OpenCamera> find_cameras(const std::string& bus);

struct Outside {
  // Opens the sink to the daemon that the options name. Not used for output to a file. Must be set.
  std::function<Result<std::unique_ptr<frontend::KeyframeSink>>(const RunOptions&, const publishing::PublisherOptions&,
                                                                const SessionHeader&)>
      open_daemon_sink;
  Logs logs = {};
  std::function<Result<std::unique_ptr<capture::StereoSource>>(const RunOptions&)> open_pairs = open_recording;
  std::function<Result<OpenCamera>(const std::string& bus)> cameras_on = find_cameras;
};

}  // namespace relmap::workflow
