// One run of relmap-frontend, from its input to a file or the daemon: chooses the workflow.
#pragma once

#include <atomic>

#include "frontend/console.h"
#include "frontend/workflow/outside.h"
#include "frontend/workflow/run.h"
#include "frontend/workflow/run_options.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// `stop` may be set from any thread or a signal handler: the run ends soon, in order. `summary` is filled however it
// ends. Reasons: open_source()'s, KeyframeLog::open()'s, read_imu()'s, those of the sink; INVALID_ARGUMENT: what would
// be written over something that is needed, or no name for the robot; NOT_STEREO: one eye and not `mono`;
// NOT_STEREO, ROWS_APART, EYE_DEAD: what the first pairs of a recording show is wrong (RigCheck), and nothing was
// begun; TOO_FEW_FEATURES: no pair could be tracked, no picture shows enough: then nothing of a recording is sent.
Status run_frontend(const RunOptions& options, const Outside& outside, const std::atomic<bool>& stop,
                    frontend::RunSummary& summary, const Waits& waits = {});

}  // namespace relmap::workflow
