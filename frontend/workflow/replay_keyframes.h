// The workflows that send existing keyframes, from a keyframe file or from a log of what a robot published.
#pragma once

#include "frontend/workflow/run.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// Both send the keyframes at the run's rate, as a new session unless options.as_recorded. Keyframes up to the last one
// in the spool are passed over. If reading fails, the keyframes before are sent, and the reader's reason is returned.
// BAD_SIZE if there is no keyframe; UNSUPPORTED if a report, pictures of tracks or all pairs are asked for, since there
// are no pairs; Delivery's reasons.
Status replay_file(Run& run);
Status replay_log(Run& run);

}  // namespace relmap::workflow
