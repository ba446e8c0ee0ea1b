// The pipeline from stereo pairs to published keyframes. Its stages work on different pairs at the same time.
//
//   capture -> left eye  -> tracking -> description -> publishing
//          \-> right eye -/
//
// The caller's thread captures; each other stage has its own thread, with a bounded queue before it. A slow stage makes
// the stages before it wait. If the source cannot wait, the oldest waiting pair is dropped instead. Unless pairs are
// dropped, the results are bit for bit those of a single thread.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "frontend/tracking/keyframe_pictures.h"
#include "frontend/tracking/latencies.h"
#include "frontend/tracking/pair.h"
#include "frontend/tracking/stamps.h"
#include "frontend/tracking/tracker.h"
#include "frontend/vision/rectify.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::tracking {

// As a source gives it. An eye without a picture is empty: the pair is tracked with the other one.
struct CapturedPair {
  vision::Image left, right;  // raw
  std::int64_t time_us = 0;
  Status eye_missing = {};   // why one picture is empty, if that is to be counted
  std::uint64_t index = 0;   // in the source
  std::string picture = {};  // file name of the left picture; may be empty
  // When the pair arrived; if not set, when capture() returned it.
  std::optional<std::chrono::steady_clock::time_point> arrived = {};
};

// A pair after tracking.
struct TrackedPair {
  std::shared_ptr<const Pair> pair;
  std::int64_t time_us = 0;  // after StampFilter
  std::uint64_t index = 0;   // of the CapturedPair, as is `picture`
  std::string picture;
  bool both_came = true;  // both pictures arrived, whatever they show
  PairReport report;
  std::optional<Keyframe> keyframe;               // complete, with appearance and picture
  std::chrono::steady_clock::time_point arrived;  // of the CapturedPair; if not set, when capture() returned it
  double left_ms = 0, right_ms = 0;               // rectification and preparation of each eye
  double tracking_ms = 0;                         // all of tracking; the report's stages are parts of it
  double description_ms = 0;                      // 0 if the pair is no keyframe
  double until_tracked_ms = 0;                    // from `arrived` until it was tracked
};

// Functions of the caller. Each is called by one thread at a time, and never after Pipeline::run() has returned. An
// exception ends the run and is rethrown by run().
struct PipelineStages {
  // Returns the next pair, on the caller's thread. Nothing ends the run, once the pairs before are published. An error
  // means that one pair is not available; the run goes on.
  std::function<Result<std::optional<CapturedPair>>()> capture;
  // Called on the tracking thread before a pair of that time is tracked, for example to feed a gyro. May be empty.
  std::function<void(StereoTracker&, std::int64_t time_us)> before_tracking;
  // Takes each tracked pair in order, on the publishing thread. An error ends the run.
  std::function<Status(TrackedPair&)> publish;
  // Told, on any stage's thread, why a pair or one eye of it was left out; the message names the pair. May be empty.
  std::function<void(const Status&)> refused;
};

struct PipelineOptions {
  std::size_t waiting = 4;   // maximum number of pairs that wait before each stage
  bool drop_oldest = false;  // if a new pair finds the first queue full, its oldest pair is dropped
  int appearance = 300;      // maximum number of features of a keyframe's appearance set
  KeyframePicture picture = KeyframePicture::kWhole;
  StampFilter stamps;  // if a session is continued, it starts at the last keyframe's time
};

struct PipelineSummary {
  std::uint64_t tracked = 0;                // pairs given to publish()
  std::uint64_t dropped = 0;                // pairs dropped to make room
  std::map<Reason, std::uint64_t> refused;  // capture()'s errors, missing eyes, TIME_BACKWARDS, TIME_AHEAD, BAD_SIZE
  // Time from a pair's arrival until it was tracked, and until publish() was called with its keyframe.
  Latencies tracking, keyframes;
};

// NOT_STEREO if `camera` has one eye (baseline 0): metric scale cannot be measured with it.
Status check_stereo(const StereoCamera& camera);

// Not thread-safe.
class Pipeline {
 public:
  // `tracker` and `rectifier` are of the same camera and must outlive the pipeline.
  Pipeline(StereoTracker& tracker, const vision::Rectifier& rectifier, PipelineStages stages,
           PipelineOptions options = {});
  ~Pipeline();

  // Runs the pipeline; may be called once. Returns when all its threads have ended. NOT_STEREO, and publish()'s error.
  Status run();
  // Valid after run(), however it ended.
  const PipelineSummary& summary() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::tracking
