// What the intake tells of itself: counts of what came in and what became of it, since the daemon started; the state of
// each robot; and events of robots for the log.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/status.h"
#include "storage/graph/frame.h"

namespace relmap::intake {

using ReasonCounts = std::array<std::uint64_t, 128>;  // by Reason

inline std::size_t index_of(Reason reason) { return static_cast<std::size_t>(reason); }

struct IngestStats {
  std::uint64_t parts = 0;               // received
  std::uint64_t repeated_parts = 0;      // of keyframes that had come already
  ReasonCounts parts_refused{};          // damaged, outside the window, or no room; asked for again where that helps
  std::uint64_t keyframes_received = 0;  // complete ones
  std::uint64_t keyframes_durable = 0;   // in the journal
  ReasonCounts keyframes_refused{};      // refused for good, and conflicts, which settle nothing
  ReasonCounts refused_before_begin{};   // part of these: of sessions that have not begun, so nothing is journalled yet
  std::uint64_t sequences_given_up = 0;  // by gaps
  ReasonCounts messages_refused{};       // gaps, ends, and bytes that are no message of relmap
  std::uint64_t evicted = 0;             // keyframes dropped for want of memory
  std::uint64_t acknowledgements = 0;    // sent
  std::uint64_t sessions = 0;            // being taken in now
  std::uint64_t heard = 0;               // sessions heard from in the last minute
  std::uint64_t incomplete = 0;          // keyframes of which parts are missing now
  Status blocked;                        // why the sink journals nothing now
};

// The state of one session that is being taken in (relmap.v1.Robot). Counts start when it was first heard.
struct RobotStats {
  SessionUuid uuid;
  SessionNumber session = 0;  // 0: not begun
  // Of one of which everything was refused, the robot is the one that it has proved to be, or else what its keyframes
  // say. Empty: neither is known.
  std::string robot, name;
  double keyframes_per_s = 0, bytes_per_s = 0;
  std::int64_t silent_us = 0;  // since it was last heard
  std::int64_t lag_us = -1;    // from the time stamp of its newest durable keyframe until it was durable; -1: unknown
  std::uint64_t next_sequence = 0, seen_end = 0;
  std::uint32_t missing = 0, incomplete = 0, pending = 0, credits = 0;
  std::uint32_t queued = 0;   // parts that wait to be taken in
  std::uint64_t dropped = 0;  // parts for which the queue had no room
  std::map<Reason, std::uint64_t> refused, not_taken;
  Reason blocked = Reason::OK;
  double limit_hz = 0;                 // 0: no limit
  std::vector<SessionUuid> same_name;  // sessions that other robots of this name send at the same time
  bool silent = false;                 // it fell silent without an end and was forgotten; values as last heard
};

// Whether a silent robot is not missing, because its session in the map (nullopt: the map has none) has ended since or
// is being deleted.
inline bool has_left(const RobotStats& robot, const std::optional<storage::Session>& session) {
  if (!robot.silent || !session) return false;
  return storage::is_going(*session) || session->state == storage::SessionState::kEnded;
}

// An event of a robot that sends keyframes.
struct RobotEvent {
  enum class Kind : std::uint8_t {
    kHeard,     // keyframes of the session come in for the first time, or again after a silence or a restart
    kSilent,    // nothing came for a while, although the robot has not ended the session
    kSameName,  // another robot of this name sends another session at the same time
  };
  Kind kind = Kind::kHeard;
  SessionUuid uuid;
  SessionNumber session = 0;
  std::string robot, name;          // from the session's header
  std::uint64_t next_sequence = 0;  // everything below is settled
  std::chrono::seconds silent{0};   // time since the robot was last heard
};

}  // namespace relmap::intake
