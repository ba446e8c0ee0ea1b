// Lists the sessions that a log holds, since a log may have the keyframes of several robots.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "frontend/recording/event_log.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::recording {

struct RecordedSession {
  SessionHeader header;               // of its first complete keyframe
  std::uint32_t first = 0, last = 0;  // range of the sequences of which anything was recorded
};

// Lists the sessions that have a complete keyframe, in the order of their beginnings. Reads the whole log and rewinds
// it. If there is none: BAD_SIZE if the log has no messages of relmap, otherwise the reason why these could not be
// read. BUDGET_EXCEEDED if there are more than a thousand.
Result<std::vector<RecordedSession>> list_sessions(EventLog& log);

// Returns the session with that uuid or name, or the only one if `choice` is empty. INVALID_ARGUMENT if there are
// several, NO_SUCH_SESSION; the message lists all sessions.
Result<RecordedSession> choose_session(const std::string& log_name, const std::vector<RecordedSession>& sessions,
                                       const std::string& choice);

}  // namespace relmap::recording
