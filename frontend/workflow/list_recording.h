// What a recording is, without tracking it.
#pragma once

#include "frontend/workflow/outside.h"
#include "frontend/workflow/run_options.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// What a recording is, on standard output, an object a line; no picture is read but the first. Of pairs and keyframes
// one: "fingerprint", "count", "contents", "calibration" (RecordingIdentity), of pairs whose times nothing tells
// "supposed_rate_hz", of keyframes "uuid", "robot" and "name" of their session, too. Of a log one for each session:
// "uuid", "robot", "name", "first", "last". Of photographs (`mono`) one for each camera: "camera", "pictures", what
// recordings of pairs have where they can be read at all, and what lies beside them, "folders_passed_over" and
// "files_passed_over"; the heads of all are read. Reasons: open_source()'s, EventLog::open()'s, list_sessions()'s,
// open_mono_images()'s, identity_of_keyframes()'s; INVALID_ARGUMENT: a camera.
Status list_recording(const RunOptions& options, const Outside& outside);

}  // namespace relmap::workflow
