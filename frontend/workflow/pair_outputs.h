// The optional outputs for each tracked pair: a table of figures (--report) and pictures of the tracks (--show).
#pragma once

#include <memory>
#include <optional>

#include "frontend/report_file.h"
#include "frontend/track_show.h"
#include "frontend/tracking/pipeline.h"
#include "frontend/workflow/run_options.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// Not thread-safe.
class PairOutputs {
 public:
  // Opens the outputs that the options name. If `goes_on`, the run continues an interrupted one, and its outputs are
  // appended to. The reasons of open_track_show() and ReportFile::open().
  static Result<PairOutputs> open(const RunOptions& options, bool goes_on);

  // Must be called in the order of the pairs, before the keyframe is moved out of the pair. TrackShow::show()'s
  // reasons.
  Status add(const tracking::TrackedPair& pair);
  Status close();  // IO_ERROR if something could not be written

 private:
  PairOutputs() = default;

  std::optional<frontend::ReportFile> report_;
  std::unique_ptr<frontend::TrackShow> show_;
};

}  // namespace relmap::workflow
