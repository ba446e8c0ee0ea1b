// Describes a recording without tracking it.
#pragma once

#include "frontend/workflow/outside.h"
#include "frontend/workflow/run_options.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// Prints one JSON object a line on standard output. No picture but the first is read, except for the headers of all
// photographs. Members of the objects:
// - pairs, one object: "fingerprint", "count", "contents", "calibration" (RecordingIdentity), and "supposed_rate_hz" if
//   the recording has no times;
// - a keyframe file, one object: "uuid", "robot" and "name" of its session, and the RecordingIdentity;
// - a log, one object a session: "uuid", "robot", "name", "first", "last";
// - photographs (`mono`), one object a camera: "camera", "pictures", the RecordingIdentity if they can be read and
//   otherwise "error", and what else is in the folder, "folders_passed_over" and "files_passed_over".
//
// The reasons of open_source(), EventLog::open(), list_sessions(), open_mono_images() and identity_of_keyframes();
// INVALID_ARGUMENT for a camera.
Status list_recording(const RunOptions& options, const Outside& outside);

}  // namespace relmap::workflow
