// The workflows of keyframes that are ready made: out of a file of them, or out of a log of what a robot published.
#pragma once

#include "frontend/workflow/run.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// At the run's rate, as a session of their own unless they are sent as recorded. What a spool knows already is passed
// over. Reasons: those of who reads them, after what came before is sent; BAD_SIZE: there is none; UNSUPPORTED: a
// report, tracks to be shown or all pairs are asked for, and there are no pairs; Delivery's.
Status replay_file(Run& run);
Status replay_log(Run& run);

}  // namespace relmap::workflow
