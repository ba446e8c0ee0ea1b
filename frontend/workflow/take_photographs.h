// The workflow for pictures of one camera: each picture becomes a keyframe of a mono session.
#pragma once

#include "frontend/workflow/run.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// The reasons of open_mono_images(), Delivery and PictureReport::open(). If no picture became a keyframe, the reason
// why one of them did not, or NO_SUCH_FILE.
Status take_photographs(Run& run);

}  // namespace relmap::workflow
