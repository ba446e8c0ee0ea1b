// What happened to the map, as those who watch it are told (proto/relmap/v1/watch.proto). An event says what holds
// after it. Events follow from journal records, so a record that is applied again after a crash gives the same events;
// only what relaxation moved is gathered between two commits.
#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "storage/graph/frame.h"
#include "storage/journal/journal_record.h"

namespace relmap::storage {

// Where an event stands in the log.
struct EventPosition {
  std::uint64_t sequence = 0;  // of the journal record that brought it about, or of the last one before a commit
  std::uint32_t ordinal = 0;   // among the events of that record, from 0; kMoved: what a commit gathered

  auto operator<=>(const EventPosition&) const = default;
};
inline constexpr std::uint32_t kMovedOrdinal = ~std::uint32_t{0};

// A session began, ended, was frozen or thawed, or its deletion began.
struct SessionEvent {
  SessionNumber session = 0;
  SessionUuid uuid;
  std::string robot, display_name;
  SessionState state = SessionState::kOpen;
};
struct FrameAddedEvent {
  FrameId frame;
  std::int64_t time_us = 0;
  std::optional<SE3> T_previous_frame;  // along its odometry or prior edge, as applied
  MotionSource source = MotionSource::kStart;
};
struct SkippedEvent {
  SessionNumber session = 0;
  Skipped skipped;
};
// The frame `first` and all after it went with a session that is being deleted.
struct FramesRemovedEvent {
  SessionNumber session = 0;
  std::uint32_t first = 0;
};
struct SessionDeletedEvent {
  SessionNumber session = 0;
  SessionUuid uuid;
};
// A closure was proposed, or its state, reason or place in the graph changed.
struct ClosureEvent {
  EdgeId id;
  FrameId a;
  EdgeKind kind = EdgeKind::kLoop;
  EdgeState state = EdgeState::kCandidate;
  Reason reason = Reason::LONE;
  bool carries = false;
  SE3 T_ab;
  Verification verification = Verification::kNone;
  std::uint16_t inliers = 0;
  float probability = 0, spread = 0;
};
struct ClosureRemovedEvent {
  EdgeId id;
};
struct LabelsEvent {
  FrameId frame;
  std::vector<std::string> labels;  // all that it has now
};
// Frames whose edges relaxation changed since the commit before, ascending.
struct FramesMovedEvent {
  std::vector<FrameRange> ranges;
};
using EventContent = std::variant<SessionEvent, FrameAddedEvent, SkippedEvent, FramesRemovedEvent, SessionDeletedEvent,
                                  ClosureEvent, ClosureRemovedEvent, LabelsEvent, FramesMovedEvent>;

struct Event {
  EventPosition at;
  Submission submitted;  // of the record; of frames moved: when they were committed
  std::string note;      // an operator's
  EventContent content;
  std::int64_t committed_us = 0;  // when it was committed, UTC; set where it is read from the log
};

}  // namespace relmap::storage
