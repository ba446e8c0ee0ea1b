// Which session a run publishes, and how, by its options and by what it reads.
#pragma once

#include <string>

#include "frontend/publishing/publisher.h"
#include "frontend/workflow/run_options.h"
#include "proto/base/status.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::workflow {

// What `recorded` has holds where the options ask for nothing else; a uuid only as recorded, else a nil one is left for
// the sink to choose. INVALID_ARGUMENT: the robot has no name; BAD_NAME.
Result<SessionHeader> session_header(const RunOptions& options, const SessionHeader& recorded);

// `recording`: what the session is made of (DiskSpool::open()), to which is added what makes other keyframes of it.
// `spool_suffix`: of the default spool, where a robot's session of one name may be several.
publishing::PublisherOptions publisher_options(const RunOptions& options, const SessionHeader& session,
                                               const std::string& recording, const std::string& spool_suffix);

}  // namespace relmap::workflow
