// The output of relmap-frontend: progress while it runs, and a summary at the end.
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
  // The session of the keyframes. The other fields describe this run only, which may continue a session that another
  // run began.
  std::string robot, session, uuid;
  std::string spool;  // folder where keyframes wait until they are settled; empty if in memory, and for a file
  std::optional<std::uint32_t> gone_on;  // the keyframe after which this run continues
  bool ready_made = false;               // the input was keyframes, so there were no pairs to track
  bool mono = false;                     // the input was pictures of one camera; `pairs` counts them
  std::uint64_t pairs = 0;               // given to the tracker: tracked + repeated + lost
  std::uint64_t tracked = 0;             // with a pose from vision, and the first one
  std::uint64_t repeated = 0;            // the camera sent the previous picture again
  std::uint64_t lost = 0;
  std::uint64_t one_eyed = 0;  // tracked with one eye only
  std::uint64_t dropped = 0;   // pairs of a live source that were dropped to keep up
  // Pairs that there should have been: those that the source has, or those that the run reached if it continues another
  // run or was interrupted. 0 if there are no pairs.
  std::uint64_t expected = 0;
  std::uint64_t seen = 0;                // pairs of which both pictures came
  std::uint64_t measured = 0;            // seen pairs that were tracked
  capture::MissingPictures missing;      // pictures of expected pairs
  std::optional<vision::RigReport> rig;  // check of the stereo camera on the first pairs
  std::uint64_t keyframes = 0;
  std::uint64_t metric_steps = 0;  // keyframes whose step vision measured
  std::uint64_t steps = 0;         // keyframes that have a step
  double path_m = 0;               // length of the odometry
  double tracking_ms = 0;          // sum over all pairs; for mono, of describing the pictures
  double wall_s = 0;
  double offset_px = 0;                                 // learnt error of all disparities that the calibration left
  double latency_p50_ms = 0, latency_p99_ms = 0;        // of keyframes: from the pair's arrival to publishing
  double tracked_p50_ms = 0, tracked_p99_ms = 0;        // of all pairs: from arrival until tracked
  std::map<Reason, std::uint64_t> unreadable;           // pictures that could not be read
  std::map<Reason, std::uint64_t> stamps_refused;       // pairs left out for their time stamp
  std::vector<Status> left_out;                         // of a recording: each item of the two above, with its file
  std::optional<capture::RecordingIdentity> recording;  // what was read; not set for a camera or a log
  publishing::Localisation::Counts recognised;
  std::optional<publishing::Localisation::Place> place;  // at the end
  publishing::PublishSummary publishing;
  std::uint64_t slow_downs = 0;  // times that the daemon began to ask for fewer keyframes
  struct Camera {                // of a live source
    std::string serial;
    std::uint64_t frames = 0, lost = 0;          // frames that arrived, and that did not
    std::uint64_t reopened = 0, begun_anew = 0;  // times it was opened again, its stream restarted
    std::optional<double> drift_ppm;             // of the camera's clock relative to the host's
  };
  std::optional<Camera> camera;
  bool interrupted = false;
  Status failure;  // ok if the run did not fail

  // measured / (expected - repeated), at most 1. nullopt if no pairs were expected.
  std::optional<double> measured_share() const;
  // What is wrong with the stereo camera. Leaves out TOO_FEW_FEATURES, which means that it could not be checked.
  std::vector<Status> findings() const;
  // Whether there are no findings, and measured_share(), if there is one, is at least kMinMeasured.
  bool trusted() const;
};

inline constexpr double kMinMeasured = 0.8;

// Reports on standard error why something was left out. Each reason is printed the first few times, and then more and
// more rarely. Thread-safe.
class Refusals {
 public:
  // `max_kept` is the number of refusals that are kept for all().
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

// Shows progress. As text on standard error: a bar on a terminal, otherwise a line for every twentieth of the total. As
// JSON on standard output, for programs: one object a line, four times a second. Not thread-safe.
class ProgressLine {
 public:
  ProgressLine(std::uint64_t total, ProgressStyle style, const char* what = "pairs");
  ~ProgressLine() { end(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;
  // `trouble` is the reason why nothing reaches the daemon; ok if there is none.
  void show(const RunSummary& so_far, const publishing::PublishSummary& publishing, const Status& trouble);
  void end();  // ends the line of the bar, so that other text can follow

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
// One line of list_recording() each.
std::string recorded_session_json(const recording::RecordedSession& session);
// `supposed_rate_hz` is that of StereoSource.
std::string recording_json(const capture::RecordingIdentity& recording, double supposed_rate_hz = 0);
std::string keyframe_file_json(const capture::KeyframeFileIdentity& file);
std::string photographs_json(const capture::PhotographFolder::Camera& camera, const capture::PassedOver& passed_over);

}  // namespace relmap::frontend
