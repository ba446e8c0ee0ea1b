// The workflow of a recording of stereo pairs: checked, tracked, and sent or written.
#pragma once

#include "frontend/workflow/run.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// Reasons: open_source()'s; NOT_STEREO: one eye; NOT_STEREO, ROWS_APART, EYE_DEAD: what the first pairs show is wrong,
// and nothing was begun; those of track_pairs(), which sends nothing of a recording that cannot be tracked.
Status track_recording(Run& run);

}  // namespace relmap::workflow
