// Which sessions a log holds: a robot's keyframes may have been recorded beside those of others.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "frontend/recording/event_log.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::recording {

struct RecordedSession {
  SessionHeader header;               // of its first whole keyframe
  std::uint32_t first = 0, last = 0;  // the sequences of which anything was recorded
};

// Sessions with a whole keyframe, in the order in which they begin. Reads all of the log, and rewinds it. The reason
// there is none: BAD_SIZE (nothing of relmap's is in it), or why what is in it could not be read. BUDGET_EXCEEDED: more
// than a thousand.
Result<std::vector<RecordedSession>> list_sessions(EventLog& log);

// The one with that uuid or name; with an empty choice the only one. INVALID_ARGUMENT if there are several of them,
// NO_SUCH_SESSION; the message lists them all.
Result<RecordedSession> choose_session(const std::string& log_name, const std::vector<RecordedSession>& sessions,
                                       const std::string& choice);

}  // namespace relmap::recording
