// The workflows of relmap-frontend: what is done with each kind of source. Each returns when its source ends or the run
// is to stop.
#pragma once

#include "frontend/workflow/run.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// A live stereo camera: waits for it, tracks it until the run is to stop, and checks its calibration.
// With options.wait, waits for a camera that is not connected yet or not available. If the camera does not agree with
// its calibration, this is reported and tracking continues. The reasons of open_camera_buses(), IidcSource::open() and
// track_pairs(); NOT_STEREO if the camera has one eye.
Status track_camera(Run& run);

// A recording of stereo pairs: checks it, tracks it, and delivers its keyframes.
// The reasons of open_source() and track_pairs(). NOT_STEREO if the source has one eye. NOT_STEREO, ROWS_APART or
// EYE_DEAD if the first pairs show that the stereo camera is faulty; nothing is sent then. Neither is anything sent of
// a recording that cannot be tracked.
Status track_recording(Run& run);

// Pictures of one camera: each picture becomes a keyframe of a mono session.
// The reasons of open_mono_images(), Delivery and PictureReport::open(). If no picture became a keyframe, the reason
// why one of them did not, or NO_SUCH_FILE.
Status take_photographs(Run& run);

// Existing keyframes, from a keyframe file or from a log of what a robot published.
// Both send the keyframes at the run's rate, as a new session unless options.as_recorded. Keyframes up to the last one
// in the spool are passed over. If reading fails, the keyframes before are sent, and the reader's reason is returned.
// BAD_SIZE if there is no keyframe; UNSUPPORTED if a report, pictures of tracks or all pairs are asked for, since there
// are no pairs; Delivery's reasons.
Status replay_file(Run& run);
Status replay_log(Run& run);

}  // namespace relmap::workflow
