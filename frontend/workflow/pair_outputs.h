// What a run writes of every pair that is tracked: a table of figures, and pictures of the tracks.
#pragma once

#include <memory>
#include <optional>

#include "frontend/report_file.h"
#include "frontend/track_show.h"
#include "frontend/tracking/pipeline.h"
#include "frontend/workflow/run_options.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// Those that the options name. Not thread-safe.
class PairOutputs {
 public:
  // `goes_on`: what an interrupted run left is added to. Reasons: open_track_show()'s, ReportFile::open()'s.
  static Result<PairOutputs> open(const RunOptions& options, bool goes_on);

  // In order; before the keyframe is taken out of the pair. Reasons: TrackShow::show()'s.
  Status add(const tracking::TrackedPair& pair);
  Status close();  // IO_ERROR: not all of it is there

 private:
  PairOutputs() = default;

  std::optional<frontend::ReportFile> report_;
  std::unique_ptr<frontend::TrackShow> show_;
};

}  // namespace relmap::workflow
