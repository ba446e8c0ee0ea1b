// Checks that a run overwrites neither its own inputs nor its other outputs.
#pragma once

#include "frontend/workflow/run_options.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// INVALID_ARGUMENT, naming the file, if an output is also an input or another output. Different paths to one file are
// recognised.
Status check_output_paths(const RunOptions& options);

}  // namespace relmap::workflow
