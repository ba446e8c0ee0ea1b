// Pairs out of a source, at the run's rate and every n-th only, for the tracker.
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
  // Both must outlive it.
  PairReader(Run& run, capture::StereoSource& source) : run_(run), source_(source) {}

  // The next pair when it is due; nothing at the end, and once the run is to stop. An error is one pair that cannot be
  // had.
  Result<std::optional<tracking::CapturedPair>> next();

  // Passes over the pairs that an interrupted run had, up to the one of its last keyframe, of `time_us`: returns how
  // stamps go on from there. Before the first next().
  tracking::StampFilter go_on_at(std::int64_t time_us);

  // From now on it sees each pair as it is read.
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
