#include "frontend/tracking/pipeline.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <string>
#include <thread>
#include <utility>

#include "frontend/tracking/bounded_queue.h"
#include "proto/base/mutex.h"

namespace relmap::tracking {

// Fields of Pipeline::Impl cannot have types of an anonymous namespace.
struct Captured {
  CapturedPair pair;
  std::chrono::steady_clock::time_point arrived;
};

// One eye's picture, prepared for tracking.
struct Eye {
  Status status;          // why the picture is missing, if that is to be reported
  vision::Image picture;  // rectified; empty if there is none
  vision::Pyramid pyramid;
  double ms = 0;
};

struct LeftEye {
  Eye eye;
  Captured captured;  // without its pictures
};

namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

// "pair 17 (000017.png): ..."
Status of_pair(const CapturedPair& pair, const Status& status) {
  const std::string picture = pair.picture.empty() ? "" : " (" + pair.picture + ')';
  return {status.reason(), "pair " + std::to_string(pair.index) + picture + ": " + status.message()};
}

Eye prepare(const vision::Rectifier& rectifier, vision::Image raw, bool left) {
  const auto begin = Clock::now();
  Eye eye;
  if (raw.empty()) return eye;
  const StereoCamera& camera = rectifier.camera();
  if (rectifier.passes_through() && raw.width() == camera.width && raw.height() == camera.height)
    eye.picture = std::move(raw);
  else
    eye.status = left ? rectifier.left(raw, eye.picture) : rectifier.right(raw, eye.picture);
  if (eye.status.ok()) eye.pyramid = prepare_eye(eye.picture);
  eye.ms = ms_since(begin);
  return eye;
}

}  // namespace

Status check_stereo(const StereoCamera& camera) {
  if (camera.baseline > 0) return {};
  return {Reason::NOT_STEREO, "a camera of one eye (baseline 0): the front-end cannot measure metres with it"};
}

struct Pipeline::Impl {
  StereoTracker& tracker;
  const vision::Rectifier& rectifier;
  const PipelineStages stages;
  const PipelineOptions options;

  BoundedQueue<Captured> captured;
  BoundedQueue<vision::Image> right_raw;
  BoundedQueue<LeftEye> left_ready;
  BoundedQueue<Eye> right_ready;
  BoundedQueue<TrackedPair> tracked, described;

  Mutex mutex;
  std::exception_ptr failure RELMAP_GUARDED_BY(mutex);  // the first exception
  Status ended RELMAP_GUARDED_BY(mutex);                // publish()'s error
  PipelineSummary summary RELMAP_GUARDED_BY(mutex);

  Impl(StereoTracker& given_tracker, const vision::Rectifier& given_rectifier, PipelineStages given_stages,
       PipelineOptions given_options)
      : tracker(given_tracker),
        rectifier(given_rectifier),
        stages(std::move(given_stages)),
        options(given_options),
        captured(options.waiting),
        right_raw(options.waiting),
        left_ready(options.waiting),
        right_ready(options.waiting),
        tracked(options.waiting),
        described(options.waiting) {}

  void cancel() {
    captured.cancel();
    right_raw.cancel();
    left_ready.cancel();
    right_ready.cancel();
    tracked.cancel();
    described.cancel();
  }

  void refuse(const Status& status) {
    const MutexLock lock(mutex);
    ++summary.refused[status.reason()];
    if (stages.refused) stages.refused(status);
  }

  // Runs a stage until it ends. An exception ends all stages.
  template <typename Stage>
  void guarded(Stage stage) noexcept {
    try {
      stage();
    } catch (...) {
      {
        const MutexLock lock(mutex);
        if (!failure) failure = std::current_exception();
      }
      cancel();
    }
  }

  void capture() {
    StampFilter stamps = options.stamps;
    for (;;) {
      Result<std::optional<CapturedPair>> pair = stages.capture();
      if (!pair.ok()) {
        refuse(pair.status());
        continue;
      }
      if (!pair->has_value()) break;
      const Result<std::int64_t> time_us = stamps.admit((*pair)->time_us);
      if (!time_us.ok()) {
        refuse(of_pair(**pair, time_us.status()));
        continue;
      }
      (*pair)->time_us = *time_us;
      const Clock::time_point arrived = (*pair)->arrived.value_or(Clock::now());
      if (!hand_over({std::move(**pair), arrived})) break;
    }
    captured.close();
  }

  bool hand_over(Captured pair) {
    if (!options.drop_oldest) return captured.push(std::move(pair));
    const auto pushed = captured.push_dropping_oldest(std::move(pair));
    if (pushed.dropped) {
      const MutexLock lock(mutex);
      ++summary.dropped;
    }
    return pushed.taken;
  }

  void left_eye() {
    while (auto item = captured.pop()) {
      if (!right_raw.push(std::move(item->pair.right))) break;
      Eye eye = prepare(rectifier, std::move(item->pair.left), true);
      if (eye.status.ok()) eye.status = std::move(item->pair.eye_missing);
      if (!left_ready.push({std::move(eye), std::move(*item)})) break;
    }
    right_raw.close();
    left_ready.close();
  }

  void right_eye() {
    while (auto raw = right_raw.pop())
      if (!right_ready.push(prepare(rectifier, std::move(*raw), false))) break;
    right_ready.close();
  }

  void track() {
    for (bool begun = false;;) {
      auto left = left_ready.pop();
      auto right = right_ready.pop();
      if (!left || !right) break;
      const CapturedPair& named = left->captured.pair;
      if (const Status& missing = left->eye.status.ok() ? right->status : left->eye.status; !missing.ok()) {
        refuse(of_pair(named, missing));
        // A run cannot begin with one eye.
        if (!begun || (left->eye.picture.empty() && right->picture.empty())) continue;
      }
      auto result = track(*left, *right);
      if (!result.ok()) {
        refuse(of_pair(named, result.status()));
        continue;
      }
      begun = true;
      if (!tracked.push(std::move(*result))) break;
    }
    tracked.close();
  }

  // Moves the pictures out of both eyes.
  Result<TrackedPair> track(LeftEye& left, Eye& right) {
    // The tracker needs a picture of the camera's size; a black one counts as none.
    if (left.eye.picture.empty()) left.eye.picture = vision::Image(rectifier.camera().width, rectifier.camera().height);
    TrackedPair result;
    result.pair = std::make_shared<const Pair>(
        Pair{std::move(left.eye.picture), std::move(left.eye.pyramid), std::move(right.pyramid)});
    result.time_us = left.captured.pair.time_us;
    result.index = left.captured.pair.index;
    result.picture = left.captured.pair.picture;
    result.both_came = left.eye.status.ok() && right.status.ok();
    result.arrived = left.captured.arrived;
    result.left_ms = left.eye.ms;
    result.right_ms = right.ms;
    if (stages.before_tracking) stages.before_tracking(tracker, result.time_us);
    const auto begin = Clock::now();
    auto keyframe = tracker.feed(result.pair, result.time_us);
    result.tracking_ms = ms_since(begin);
    result.until_tracked_ms = ms_since(result.arrived);
    if (!keyframe.ok()) return keyframe.status();
    result.keyframe = std::move(*keyframe);
    result.report = tracker.report();
    return result;
  }

  void describe() {
    while (auto item = tracked.pop()) {
      if (item->keyframe) {
        const auto begin = Clock::now();
        item->keyframe->appearance =
            appearance_set(*item->pair, *item->keyframe, item->report.offset_px, options.appearance);
        item->keyframe->picture = keyframe_picture(item->pair->picture, options.picture);
        item->description_ms = ms_since(begin);
      }
      if (!described.push(std::move(*item))) break;
    }
    described.close();
  }

  void publish() {
    while (auto item = described.pop()) {
      {
        const MutexLock lock(mutex);
        ++summary.tracked;
        summary.tracking.add(item->until_tracked_ms);
        if (item->keyframe) summary.keyframes.add(ms_since(item->arrived));
      }
      if (Status status = stages.publish(*item); !status.ok()) {
        {
          const MutexLock lock(mutex);
          ended = std::move(status);
        }
        cancel();
        break;
      }
    }
  }
};

Pipeline::Pipeline(StereoTracker& tracker, const vision::Rectifier& rectifier, PipelineStages stages,
                   PipelineOptions options)
    : impl_(std::make_unique<Impl>(tracker, rectifier, std::move(stages), options)) {}
Pipeline::~Pipeline() = default;

Status Pipeline::run() {
  Impl& self = *impl_;
  if (Status status = check_stereo(self.rectifier.camera()); !status.ok()) return status;
  {
    std::vector<std::jthread> threads;
    self.guarded([&] {
      threads.emplace_back([&] { self.guarded([&] { self.left_eye(); }); });
      threads.emplace_back([&] { self.guarded([&] { self.right_eye(); }); });
      threads.emplace_back([&] { self.guarded([&] { self.track(); }); });
      threads.emplace_back([&] { self.guarded([&] { self.describe(); }); });
      threads.emplace_back([&] { self.guarded([&] { self.publish(); }); });
      self.capture();
    });
  }
  const MutexLock lock(self.mutex);
  if (self.failure) std::rethrow_exception(self.failure);
  return self.ended;
}

const PipelineSummary& Pipeline::summary() const { return impl_->summary; }

}  // namespace relmap::tracking
