#include "frontend/capture/first_pairs.h"
#include "frontend/capture/recording_identity.h"
#include "frontend/capture/stereo_source.h"
#include "frontend/workflow/input.h"
#include "frontend/workflow/rig_findings.h"
#include "frontend/workflow/track_pairs.h"
#include "frontend/workflow/workflows.h"

namespace relmap::workflow {

namespace {

// Opens the recording a second time, so that tracking still begins at its first pair.
Status check_eyes(Run& run) {
  auto opened = run.outside.open_pairs(run.options);
  if (!opened.ok()) return opened.status();
  run.summary.rig = capture::check_first_pairs(**opened, [&run] { return run.stop.load(); });
  if (run.summary.rig->wrong && !run.options.despite_check) return refusal_of_rig(run.summary);
  tell_rig_findings(run.summary, run.options.quiet);
  return {};
}

}  // namespace

Status track_recording(Run& run) {
  auto opened = run.outside.open_pairs(run.options);
  if (!opened.ok()) return opened.status();
  capture::StereoSource& source = **opened;
  if (Status status = introduce_stereo(run, source); !status.ok()) return status;
  run.summary.recording = capture::identity_of(source);
  if (Status status = check_eyes(run); !status.ok()) return status;
  return track_pairs(run, {.source = source, .name = name_of_path(run.options), .hold_back = true});
}

}  // namespace relmap::workflow
