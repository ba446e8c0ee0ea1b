// What people are told of a stereo camera's eyes.
#pragma once

#include "frontend/console.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// On standard error, what the check of the eyes found; that they could not be checked, unless `quiet`. The summary has
// its rig.
void tell_rig_findings(const frontend::RunSummary& summary, bool quiet);

// What is plainly wrong, all of it in the message, with what helps; the reason is the first one's.
Status refusal_of_rig(const frontend::RunSummary& summary);

}  // namespace relmap::workflow
