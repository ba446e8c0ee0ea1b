// The workflow for a live stereo camera: waits for it, tracks it until the run is to stop, and checks its calibration.
#pragma once

#include "frontend/workflow/run.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// With options.wait, waits for a camera that is not connected yet or not available. If the camera does not agree with
// its calibration, this is reported and tracking continues. The reasons of open_camera_buses(), IidcSource::open() and
// track_pairs(); NOT_STEREO if the camera has one eye.
Status track_camera(Run& run);

}  // namespace relmap::workflow
