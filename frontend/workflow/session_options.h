// The session that a run publishes and the publisher's options, derived from the run's options and its input.
#pragma once

#include <string>

#include "frontend/publishing/publisher.h"
#include "frontend/workflow/run_options.h"
#include "proto/base/status.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::workflow {

// Returns `recorded` with the robot and session names of the options, where these are given. The uuid is that of
// `recorded` if options.as_recorded; otherwise it is options.uuid, or nil if that is empty, for which the sink chooses
// a random one. INVALID_ARGUMENT if the robot has no name; BAD_NAME.
Result<SessionHeader> session_header(const RunOptions& options, const SessionHeader& recorded);

// Completes options.publisher. `recording` identifies the source of the session (DiskSpool::open()); the options that
// make other keyframes of the same source are added to it. `spool_suffix` is appended to the default spool folder, for
// inputs in which several sessions of a robot may have the same name.
publishing::PublisherOptions publisher_options(const RunOptions& options, const SessionHeader& session,
                                               const std::string& recording, const std::string& spool_suffix);

}  // namespace relmap::workflow
