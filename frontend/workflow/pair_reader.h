// Reads every n-th pair of a source for the tracker, at the run's rate.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

#include "frontend/capture/stereo_source.h"
#include "frontend/tracking/pipeline.h"
#include "frontend/tracking/stamps.h"
#include "frontend/workflow/run.h"

namespace relmap::workflow {

// Not thread-safe.
class PairReader {
 public:
  // Both must outlive this.
  PairReader(Run& run, capture::StereoSource& source) : run_(run), source_(source) {}

  // Waits until the next pair is due and returns it; nullopt at the end, and when the run is to stop. An error concerns
  // one pair, and the next call continues after it.
  Result<std::optional<tracking::CapturedPair>> next();

  // Continues an interrupted run: passes over the pairs before that of its last keyframe, whose time is `time_us`.
  // Returns the stamp filter to continue with. Must be called before the first next().
  tracking::StampFilter go_on_at(std::int64_t time_us);

  // From now on, `seen` is called with each pair as it is read.
  void show_to(std::function<void(const capture::StereoFrame&)> seen) { seen_ = std::move(seen); }

 private:
  Result<std::optional<tracking::CapturedPair>> read();

  Run& run_;
  capture::StereoSource& source_;
  std::function<void(const capture::StereoFrame&)> seen_;
  std::size_t read_ = 0;
  std::optional<tracking::CapturedPair> read_ahead_;
};

}  // namespace relmap::workflow
