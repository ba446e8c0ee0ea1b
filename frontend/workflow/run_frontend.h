// Runs relmap-frontend once, from its input to a file or the daemon.
#pragma once

#include <atomic>

#include "frontend/console.h"
#include "frontend/workflow/outside.h"
#include "frontend/workflow/run.h"
#include "frontend/workflow/run_options.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// Chooses the workflow for the input and runs it. `stop` may be set by any thread or a signal handler; the run then
// ends soon and in an orderly way. `summary` is filled in even if the run fails.
//
// The reasons of open_source(), KeyframeLog::open(), read_imu() and the sink. INVALID_ARGUMENT if an output would
// overwrite an input or another output, or if the robot has no name. NOT_STEREO if the source has one eye and `mono` is
// not set. NOT_STEREO, ROWS_APART or EYE_DEAD if the first pairs of a recording show that the stereo camera is faulty
// (RigCheck); nothing is sent then. TOO_FEW_FEATURES if no pair could be tracked or no picture has enough features;
// nothing is sent of such a recording.
Status run_frontend(const RunOptions& options, const Outside& outside, const std::atomic<bool>& stop,
                    frontend::RunSummary& summary, const Waits& waits = {});

}  // namespace relmap::workflow
