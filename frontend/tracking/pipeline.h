// The whole way of a stereo pair to a published keyframe, its stages at work on different pairs at once.
//
//   capture -> left eye  -> tracking -> description -> publishing
//          \-> right eye -/
//
// The caller's thread captures; every other stage has a thread of its own, with a bounded queue before it. A slow stage
// makes those before it wait; a source that cannot wait has its oldest waiting pair dropped instead. Unless pairs are
// dropped the results are, bit for bit, those of one thread that does one thing after another.
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
  Status eye_missing = {};                                            // why one is empty, if that is to be counted
  std::uint64_t index = 0;                                            // in the source
  std::string picture = {};                                           // the left one's file name; may be empty
  std::optional<std::chrono::steady_clock::time_point> arrived = {};  // else when capture gives it
};

// What became of a pair.
struct TrackedPair {
  std::shared_ptr<const Pair> pair;
  std::int64_t time_us = 0;  // as StampFilter gives it
  std::uint64_t index = 0;   // as capture gave them
  std::string picture;
  bool both_came = true;  // the pictures of both eyes, whatever they show
  PairReport report;
  std::optional<Keyframe> keyframe;               // complete
  std::chrono::steady_clock::time_point arrived;  // as capture tells, else when it gave the pair
  double left_ms = 0, right_ms = 0;               // rectified and made ready
  double tracking_ms = 0;                         // the report's stages together, and what lies between them
  double description_ms = 0;                      // 0: no keyframe
  double until_tracked_ms = 0;                    // since it arrived
};

// Each is called by one thread at a time, never after Pipeline::run() has returned. What one of them throws ends the
// run and comes out of run().
struct PipelineStages {
  // By the caller's thread. The next pair; nothing ends the run, once the pairs before are published. An error is one
  // pair that cannot be had.
  std::function<Result<std::optional<CapturedPair>>()> capture;
  // By the tracking thread, before a pair of that time is tracked: the place to feed a gyro. May be empty.
  std::function<void(StereoTracker&, std::int64_t time_us)> before_tracking;
  // By the publishing thread: every pair tracked, in order. An error ends the run.
  std::function<Status(TrackedPair&)> publish;
  // By any stage's thread: why a pair was left out, or one eye of it; the message names it. May be empty.
  std::function<void(const Status&)> refused;
};

struct PipelineOptions {
  std::size_t waiting = 4;   // pairs before each stage, at most
  bool drop_oldest = false;  // of the pairs that wait for the eyes, where a new one finds no room
  int appearance = 300;      // features of a keyframe's appearance set, at most
  KeyframePicture picture = KeyframePicture::kWhole;
  StampFilter stamps;  // where a session goes on: after what was before
};

struct PipelineSummary {
  std::uint64_t tracked = 0;                // pairs given to publish()
  std::uint64_t dropped = 0;                // to make room
  std::map<Reason, std::uint64_t> refused;  // capture's errors and missing eyes, TIME_BACKWARDS, TIME_AHEAD, BAD_SIZE
  // From when a pair had come, until it was tracked; until publish() was called with its keyframe.
  Latencies tracking, keyframes;
};

// NOT_STEREO: with one eye (baseline 0) there is no measure of metres.
Status check_stereo(const StereoCamera& camera);

// Not thread-safe.
class Pipeline {
 public:
  // `tracker` and `rectifier` are of the same camera and must outlive it.
  Pipeline(StereoTracker& tracker, const vision::Rectifier& rectifier, PipelineStages stages,
           PipelineOptions options = {});
  ~Pipeline();

  // Once. Returns when all its threads have ended. NOT_STEREO, publish()'s errors.
  Status run();
  // After run(), however it ended.
  const PipelineSummary& summary() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::tracking
