// What relmap-frontend says: progress while it works, a summary at the end.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "frontend/capture/photograph_folder.h"
#include "frontend/capture/recording_identity.h"
#include "frontend/capture/stereo_source.h"
#include "frontend/publishing/localisation.h"
#include "frontend/publishing/publisher.h"
#include "frontend/recording/recorded_sessions.h"
#include "frontend/vision/rig_check.h"
#include "proto/base/mutex.h"
#include "proto/base/status.h"

namespace relmap::frontend {

struct RunSummary {
  // Whose keyframes they are. What follows is of this run, which may go on with a session that another began.
  std::string robot, session, uuid;
  std::string spool;  // folder where keyframes wait until they are settled; empty: in memory, or they go into a file
  std::optional<std::uint32_t> gone_on;  // the keyframe that this run goes on after
  bool ready_made = false;               // keyframes came in: there were no pairs to track
  bool mono = false;                     // pictures of one camera, each a keyframe: `pairs` counts them
  std::uint64_t pairs = 0;               // given to the tracker; each is one of the next three
  std::uint64_t tracked = 0;             // with a pose from vision; the first one too
  std::uint64_t repeated = 0;            // the camera gave the picture before once more
  std::uint64_t lost = 0;
  std::uint64_t one_eyed = 0;  // of those tracked
  std::uint64_t dropped = 0;   // pairs of a live source that came too fast
  // Pairs that the source tells of: of a run that goes on or was interrupted those that it came to. 0: there are none.
  std::uint64_t expected = 0;
  std::uint64_t seen = 0;                // of which both pictures came
  std::uint64_t measured = 0;            // of those seen, tracked
  capture::MissingPictures missing;      // of those expected
  std::optional<vision::RigReport> rig;  // the eyes, as the first pairs show them
  std::uint64_t keyframes = 0;
  std::uint64_t metric_steps = 0;  // keyframes whose step vision measured
  std::uint64_t steps = 0;         // keyframes that have a step
  double path_m = 0;               // of the odometry
  double tracking_ms = 0;          // all pairs together; of pictures of one camera: describing them
  double wall_s = 0;
  double offset_px = 0;                            // of all disparities, as learnt: what the calibration left
  double latency_p50_ms = 0, latency_p99_ms = 0;   // of keyframes: from the captured pair to publishing
  double tracked_p50_ms = 0, tracked_p99_ms = 0;   // of all pairs: until they were tracked
  std::map<Reason, std::uint64_t> unreadable;      // pictures that the source could not give
  std::map<Reason, std::uint64_t> stamps_refused;  // pairs left out for their time stamp
  std::vector<Status> left_out;  // of these two the pictures and pairs of a recording, one by one, with their files
  std::optional<capture::RecordingIdentity> recording;  // what was read; nothing: a camera, or a log
  publishing::Localisation::Counts recognised;
  std::optional<publishing::Localisation::Place> place;  // at the end
  publishing::PublishSummary publishing;
  std::uint64_t slow_downs = 0;  // times that the daemon asked for fewer keyframes
  struct Camera {                // a live one
    std::string serial;
    std::uint64_t frames = 0, lost = 0;          // that came, that did not
    std::uint64_t reopened = 0, begun_anew = 0;  // plugged in again; its stream, for another reason
    std::optional<double> drift_ppm;             // of its clock
  };
  std::optional<Camera> camera;
  bool interrupted = false;
  Status failure;  // ok: none

  // Of the pairs expected, but for those that the camera gave twice. Nothing: none was expected.
  std::optional<double> measured_share() const;
  // What is wrong with the eyes. What there was too little to see for is no finding.
  std::vector<Status> findings() const;
  // Nothing was found wrong, and kMinMeasured of the pairs expected were measured.
  bool trusted() const;
};

inline constexpr double kMinMeasured = 0.8;

// Says on standard error why something was left out: each reason's first few times, and then ever more rarely. From any
// thread.
class Refusals {
 public:
  // So many are kept for all().
  explicit Refusals(std::size_t max_kept = 0) : max_kept_(max_kept) {}
  void say(const Status& status);
  std::vector<Status> all() const;

 private:
  const std::size_t max_kept_;
  mutable Mutex mutex_;
  std::map<Reason, std::uint64_t> counts_ RELMAP_GUARDED_BY(mutex_);
  std::vector<Status> kept_ RELMAP_GUARDED_BY(mutex_);
};

enum class ProgressStyle { kNone, kText, kJson };

// Text: a bar that redraws itself on a terminal, a line for every twentieth otherwise, on standard error. JSON: an
// object a line on standard output, four times a second, for programs. Not thread-safe.
class ProgressLine {
 public:
  ProgressLine(std::uint64_t total, ProgressStyle style, const char* what = "pairs");
  ~ProgressLine() { end(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;
  // `trouble`: why nothing gets to the daemon.
  void show(const RunSummary& so_far, const publishing::PublishSummary& publishing, const Status& trouble);
  void end();  // of the bar: something else is written

 private:
  using Clock = std::chrono::steady_clock;
  void show_text(const RunSummary& so_far, const publishing::PublishSummary& publishing);
  void show_json(const RunSummary& so_far, const publishing::PublishSummary& publishing, const Status& trouble);

  std::uint64_t total_, next_line_ = 0;
  ProgressStyle style_;
  bool terminal_, drawn_ = false;
  const char* what_;
  Clock::time_point begin_, shown_;
};

std::string summary_text(const RunSummary& summary);
std::string summary_json(const RunSummary& summary);
// For who wants to know what a recording is before it is read.
std::string recorded_session_json(const recording::RecordedSession& session);
// `supposed_rate_hz`: StereoSource's.
std::string recording_json(const capture::RecordingIdentity& recording, double supposed_rate_hz = 0);
std::string keyframe_file_json(const capture::KeyframeFileIdentity& file);
std::string photographs_json(const capture::PhotographFolder::Camera& camera, const capture::PassedOver& passed_over);

}  // namespace relmap::frontend
