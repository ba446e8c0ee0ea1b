// What relmap-frontend says: progress while it works, a summary at the end.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "frontend/publishing/localisation.h"
#include "frontend/publishing/publisher.h"
#include "proto/status.h"

namespace relmap {

struct RunSummary {
  // Whose keyframes they are. What follows is of this run, which may go on with a session that another began.
  std::string robot, session, uuid;
  std::string spool;                     // where keyframes wait until they are settled; empty: they go into a file
  std::optional<std::uint32_t> gone_on;  // the keyframe that this run goes on after
  bool ready_made = false;               // keyframes came in: there were no pairs to track
  bool mono = false;                     // pictures of one camera, each a keyframe: `pairs` counts them
  std::uint64_t pairs = 0;               // given to the tracker; each is one of the next three
  std::uint64_t tracked = 0;             // with a pose from vision; the first one too
  std::uint64_t repeated = 0;            // the camera gave the picture before once more
  std::uint64_t lost = 0;
  std::uint64_t one_eyed = 0;  // of those tracked
  std::uint64_t dropped = 0;   // pairs of a live source that came too fast
  std::uint64_t keyframes = 0;
  std::uint64_t metric_steps = 0;  // keyframes whose step vision measured
  std::uint64_t steps = 0;         // keyframes that have a step
  double path_m = 0;               // of the odometry
  double tracking_ms = 0;          // all pairs together; of pictures of one camera: describing them
  double wall_s = 0;
  double offset_px = 0;                            // of all disparities, as learnt: what the calibration left
  double latency_p50_ms = 0, latency_p99_ms = 0;   // of keyframes: from the captured pair to publishing
  std::map<Reason, std::uint64_t> unreadable;      // pictures that the source could not give
  std::map<Reason, std::uint64_t> stamps_refused;  // pairs left out for their time stamp
  Localisation::Counts recognised;
  std::optional<Localisation::Place> place;  // at the end
  PublishSummary publishing;
  bool interrupted = false;
  Status failure;  // ok: none
};

// Says on standard error why something was left out: each reason's first few times, and then ever more rarely. From any
// thread.
class Refusals {
 public:
  void say(const Status& status);

 private:
  std::mutex mutex_;
  std::map<Reason, std::uint64_t> counts_;
};

// A bar that redraws itself on a terminal, a line for every twentieth otherwise. Writes to standard error.
class ProgressLine {
 public:
  ProgressLine(std::uint64_t total, bool quiet, const char* what = "pairs");
  void show(std::uint64_t done, std::uint64_t keyframes, const PublishSummary& publishing);
  void end();

 private:
  using Clock = std::chrono::steady_clock;
  std::uint64_t total_, next_line_ = 0;
  bool quiet_, terminal_, drawn_ = false;
  const char* what_;
  Clock::time_point begin_, shown_;
};

std::string summary_text(const RunSummary& summary);
std::string summary_json(const RunSummary& summary);

}  // namespace relmap
