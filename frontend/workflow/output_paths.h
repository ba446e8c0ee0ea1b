// Nothing is written over what a run is made from, nor over something else that it writes.
#pragma once

#include "frontend/workflow/run_options.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// INVALID_ARGUMENT, naming the file. Files are the same whatever their paths look like.
Status check_output_paths(const RunOptions& options);

}  // namespace relmap::workflow
