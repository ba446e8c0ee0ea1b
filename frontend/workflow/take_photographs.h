// The workflow of pictures of one camera: each becomes a keyframe of a mono session by itself.
#pragma once

#include "frontend/workflow/run.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// Reasons: open_mono_images()'s, Delivery's, PictureReport::open()'s; where no picture became a keyframe, why one of
// them did not, or NO_SUCH_FILE.
Status take_photographs(Run& run);

}  // namespace relmap::workflow
