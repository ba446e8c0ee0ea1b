// Messages about a stereo camera that does not agree with its calibration (RigCheck).
#pragma once

#include "frontend/console.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// Prints the findings about the stereo camera on standard error and, unless `quiet`, that it could not be checked.
// summary.rig must be set.
void tell_rig_findings(const frontend::RunSummary& summary, bool quiet);

// The status that refuses a recording with findings. The message has all findings with advice; the reason is that of
// the first. There must be at least one.
Status refusal_of_rig(const frontend::RunSummary& summary);

}  // namespace relmap::workflow
