// What Client::watch() tells, as plain values. relmap/v1/watch.proto has the full description.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "client/map_types.h"

namespace relmap::client {

struct WatchOptions {
  // Only events of these sessions, closures with an end in one of them, and events of no session; empty: all.
  std::vector<SessionNumber> sessions = {};
  enum class From : std::uint8_t { kNow, kOldest };
  From from = From::kNow;         // kOldest: the oldest event that the daemon keeps
  std::string resume_token = {};  // of an event that was received: goes on after it, whatever `from` says
  bool no_frames = false;  // without events of motion (frames added and moved, sequences skipped), which are most
  bool reconnect = true;   // goes on after the last event if the connection breaks or the daemon restarts
  // Asked several times a second; true ends the watch, with OK. Empty: only the sink does.
  std::function<bool()> stopped = {};
  // A connection over which nothing came for so long is dead: the daemon says something every 15 s.
  std::chrono::milliseconds dead_after{45000};
};

// A session began, ended, was frozen or thawed, or its deletion began. Client::sessions() has the rest.
struct SessionChanged {
  SessionNumber session = 0;
  std::string uuid, robot, name;
  SessionState state = SessionState::kOpen;
};
struct AddedFrame {
  FrameId frame;
  std::int64_t time_us = 0;
  // As it was when the frame was added; absent: the session's first frame, or one that no motion joins to the frame
  // before.
  std::optional<SE3> T_previous_this;
  MotionSource source = MotionSource::kStart;
};
struct FramesAdded {
  std::vector<AddedFrame> frames;  // of any sessions, in the order in which the map took them in
};
// Consecutive frames of a session.
struct FrameRange {
  SessionNumber session = 0;
  std::uint32_t first = 0, last = 0;  // indices, inclusive
};
// Relaxation changed the edges of these frames.
struct FramesMoved {
  std::vector<FrameRange> ranges;  // ascending
};
// These sequences will have no frame.
struct SequencesSkipped {
  SessionNumber session = 0;
  std::uint32_t first = 0, last = 0;  // inclusive
  Reason reason = Reason::OK;
  bool refused = false;  // false: the robot gave them up
};
// The frame `first` and all after it went with a session that is being deleted.
struct FramesRemoved {
  SessionNumber session = 0;
  std::uint32_t first = 0;
};
struct SessionDeleted {
  SessionNumber session = 0;
  std::string uuid;
};
// A loop closure was proposed, or changed its state. Of `edge` there are id, a, b, kind, state, reason, carries, T_ab,
// verification, inliers, probability and spread; Client::edges() has the rest.
struct EdgeChanged {
  Edge edge;
};
// A closure went with a deleted session. Told whatever sessions are asked for.
struct EdgeRemoved {
  EdgeId edge;
};
struct LabelsChanged {
  FrameId frame;
  std::vector<std::string> labels;  // all that it has now
};
// A robot appeared, fell silent, or is blocked for another reason. That it ended its session, SessionChanged says.
struct RobotChanged {
  RobotStatus robot;
};
struct StorageChanged {
  Status state;  // why nothing is taken in; OK
};
// Events were lost to this watcher: what it holds is out of date, and it has to list again. It goes on with what
// happens from here on.
struct Resynced {
  Reason reason = Reason::VIEW_EXPIRED;  // they are no longer kept; WRONG_MAP: the token is of another map
  std::string message;
  std::uint64_t missed_after = 0;   // the journal sequence of the last event before them; 0: not known
  std::uint64_t missed_before = 0;  // events from this sequence on are told
};
// Everything was told that is committed.
struct CaughtUp {
  std::uint64_t journal_sequence = 0;
  std::int64_t time_us = 0;  // when that was committed, UTC
};
// Of the watch itself: a daemon answers, or no longer does and is looked for.
struct WatchConnected {};
struct WatchDisconnected {
  Status why;
};

struct WatchEvent {
  std::variant<SessionChanged, FramesAdded, FramesMoved, SequencesSkipped, FramesRemoved, SessionDeleted, EdgeChanged,
               EdgeRemoved, LabelsChanged, RobotChanged, StorageChanged, Resynced, CaughtUp, WatchConnected,
               WatchDisconnected>
      what;
  std::string resume_token;  // of the watch itself: that of the last event
  // When the record that brought it about was submitted, UTC; of frames added and moved and sequences skipped, when it
  // was committed; 0: not of the log.
  std::int64_t time_us = 0;
  // The name in the caller's credentials, or "relmapd" for what no caller did: the daemon itself, or a robot's own
  // stream. Of what goes with a deleted session, who deleted it. Empty: not of the log.
  std::string author;
  std::uint64_t journal_sequence = 0;  // of that record
  std::string note;                    // an operator's
};

}  // namespace relmap::client
