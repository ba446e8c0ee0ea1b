// The workflow for a recording of stereo pairs: checks it, tracks it, and delivers its keyframes.
#pragma once

#include "frontend/workflow/run.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// The reasons of open_source() and track_pairs(). NOT_STEREO if the source has one eye. NOT_STEREO, ROWS_APART or
// EYE_DEAD if the first pairs show that the stereo camera is faulty; nothing is sent then. Neither is anything sent of
// a recording that cannot be tracked.
Status track_recording(Run& run);

}  // namespace relmap::workflow
