// What came in and what became of it, since the daemon started.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/status.h"

namespace relmap::intake {

using ReasonCounts = std::array<std::uint64_t, 128>;  // by Reason

inline std::size_t index_of(Reason reason) { return static_cast<std::size_t>(reason); }

struct IngestStats {
  std::uint64_t parts = 0;               // received
  std::uint64_t repeated_parts = 0;      // of keyframes that were there already
  ReasonCounts parts_refused{};          // damaged, out of the window, no room; asked for again where that helps
  std::uint64_t keyframes_received = 0;  // whole
  std::uint64_t keyframes_durable = 0;   // taken into the journal
  ReasonCounts keyframes_refused{};      // settled so, and conflicts, which settle nothing
  ReasonCounts refused_before_begin{};   // of them, those of sessions that have not begun: nothing of it is journalled
  std::uint64_t sequences_given_up = 0;  // by gaps
  ReasonCounts messages_refused{};       // gaps and what was no message of ours
  std::uint64_t evicted = 0;             // incomplete keyframes dropped for want of memory
  std::uint64_t acknowledgements = 0;    // made
  std::uint64_t sessions = 0;            // being taken in now
  std::uint64_t pending = 0;             // keyframes received and not settled
  Status blocked;                        // of the sink: why nothing is journalled now
};

// One session on its way in (relmap.v1.Robot). Counts are since it was heard of first.
struct RobotStats {
  SessionUuid uuid;
  SessionNumber session = 0;  // 0: not begun
  std::string robot, name;    // empty: nothing whole came yet
  double keyframes_per_s = 0, bytes_per_s = 0;
  std::int64_t silent_us = 0;
  std::int64_t lag_us = -1;  // from the time stamp of its newest durable keyframe till that was durable; -1: none
  std::uint64_t next_sequence = 0, seen_end = 0;
  std::uint32_t missing = 0, incomplete = 0, pending = 0, credits = 0;
  std::uint32_t queued = 0;   // parts that wait to be looked at
  std::uint64_t dropped = 0;  // parts for which there was no room there
  std::map<Reason, std::uint64_t> refused, not_taken;
  Reason blocked = Reason::OK;
  double limit_hz = 0;                 // 0: none
  std::vector<SessionUuid> same_name;  // other sessions that robots of this name bring at the same time
  bool silent = false;                 // without an end, and let go of: as it was heard last
};

}  // namespace relmap::intake
