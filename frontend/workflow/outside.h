// What a run reaches outside its own process. A program gives it the real things, a test others.
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

// The next of several keyframes; nothing at the end.
using NextKeyframe = std::function<Result<std::optional<Keyframe>>()>;

// Logs of keyframes as robots published them. To read one takes LCM's messages, which not every build has.
struct Logs {
  struct Session {
    SessionHeader header;
    NextKeyframe next;
    std::function<std::map<Reason, std::uint64_t>()> left_out;  // KeyframeLog::left_out()
  };
  std::function<bool(const std::string& path)> is_log = [](const std::string&) { return false; };
  // `choice`: KeyframeLog::open()'s.
  std::function<Result<Session>(const std::string& path, const std::string& choice)> open = {};
  std::function<Result<std::vector<recording::RecordedSession>>(const std::string& path)> list = {};
};

// Takes a camera that is there into use. May be called again where it was not.
using OpenCamera =
    std::function<Result<std::unique_ptr<iidc::IidcSource>>(const iidc::IidcOptions&, const std::atomic<bool>& stop)>;

// capture::open_source() of what the options name.
Result<std::unique_ptr<capture::StereoSource>> open_recording(const RunOptions& options);
// On the buses of that name; open_camera_buses()'s reason where there are none.
Result<OpenCamera> find_cameras(const std::string& bus);

struct Outside {
  // The way to the daemon that the options name, for what goes into no file. Must be set.
  std::function<Result<std::unique_ptr<frontend::KeyframeSink>>(const RunOptions&, const publishing::PublisherOptions&,
                                                                const SessionHeader&)>
      open_daemon_sink;
  Logs logs = {};
  std::function<Result<std::unique_ptr<capture::StereoSource>>(const RunOptions&)> open_pairs = open_recording;
  std::function<Result<OpenCamera>(const std::string& bus)> cameras_on = find_cameras;
};

}  // namespace relmap::workflow
