// The workflow of a live stereo camera: waited for, tracked until the run is to stop, its eyes checked meanwhile.
#pragma once

#include "frontend/workflow/run.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// With options.wait a camera that is not there yet, or not to be had, is waited for. Reasons: open_camera_buses()'s,
// IidcSource::open()'s; NOT_STEREO: one eye; those of track_pairs(). What is wrong with its eyes is told, and it goes
// on.
Status track_camera(Run& run);

}  // namespace relmap::workflow
