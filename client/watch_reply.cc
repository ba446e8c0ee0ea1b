#include "client/enum_reply.h"
#include "client/replies.h"
#include "proto/wire/convert.h"
#include "relmap/v1/watch.pb.h"

namespace relmap::client {

namespace {

Status ill_formed_event(const Status& why) {
  return {Reason::CORRUPT, "the daemon's event is ill formed: " + why.message()};
}

Result<FramesAdded> read_frames_added(const v1::FramesAdded& message) {
  FramesAdded added;
  added.frames.reserve(static_cast<std::size_t>(message.frames_size()));
  for (const v1::AddedFrame& frame : message.frames()) {
    AddedFrame& read = added.frames.emplace_back();
    const auto id = from_wire(frame.frame());
    if (!id.ok()) return ill_formed_event(id.status());
    read.frame = *id;
    read.time_us = frame.time_us();
    if (const Status known = read_enum(frame.source(), read.source); !known.ok()) return known;
    if (!frame.has_previous_from_this()) continue;
    const auto T = from_wire(frame.previous_from_this());
    if (!T.ok()) return ill_formed_event(T.status());
    read.T_previous_this = *T;
  }
  return added;
}

FramesMoved read_frames_moved(const v1::FramesMoved& message) {
  FramesMoved moved;
  for (const v1::FrameRange& range : message.ranges())
    moved.ranges.push_back({range.session(), range.first(), range.last()});
  return moved;
}

Result<SessionChanged> read_session_changed(const v1::Session& message) {
  SessionChanged changed{message.number(), message.uuid(), message.robot(), message.name(), {}};
  if (Status known = read_enum(message.state(), changed.state); !known.ok()) return known;
  return changed;
}

Status read_what(const v1::MapEvent& message, WatchEvent& event) {
  using Kind = v1::MapEvent::EventCase;
  switch (message.event_case()) {
    case Kind::kSessionChanged: {
      auto changed = read_session_changed(message.session_changed());
      if (!changed.ok()) return changed.status();
      event.what = std::move(*changed);
      break;
    }
    case Kind::kFramesAdded: {
      auto added = read_frames_added(message.frames_added());
      if (!added.ok()) return added.status();
      event.what = std::move(*added);
      break;
    }
    case Kind::kFramesMoved:
      event.what = read_frames_moved(message.frames_moved());
      break;
    case Kind::kSkipped: {
      const v1::SkippedSequences& skipped = message.skipped();
      event.what = SequencesSkipped{skipped.session(), skipped.first(), skipped.last(),
                                    reason_from_wire(skipped.reason()), skipped.refused()};
      break;
    }
    case Kind::kFramesRemoved:
      event.what = FramesRemoved{message.frames_removed().session(), message.frames_removed().first()};
      break;
    case Kind::kSessionDeleted:
      event.what = SessionDeleted{message.session_deleted().session(), message.session_deleted().uuid()};
      break;
    case Kind::kEdgeChanged: {
      auto edge = read_edge(message.edge_changed());
      if (!edge.ok()) return edge.status();
      event.what = EdgeChanged{std::move(*edge)};
      break;
    }
    case Kind::kEdgeRemoved:
      event.what = EdgeRemoved{read_id(message.edge_removed().edge())};
      break;
    case Kind::kFrameLabels: {
      const v1::FrameLabels& labels = message.frame_labels();
      event.what = LabelsChanged{read_id(labels.frame()), {labels.labels().begin(), labels.labels().end()}};
      break;
    }
    case Kind::kRobotChanged:
      event.what = RobotChanged{read_robot(message.robot_changed())};
      break;
    case Kind::kStorageChanged:
      event.what = StorageChanged{
          Status(reason_from_wire(message.storage_changed().reason()), message.storage_changed().message())};
      break;
    case Kind::kResync: {
      const v1::Resync& resync = message.resync();
      event.what =
          Resynced{reason_from_wire(resync.reason()), resync.message(), resync.missed_after(), resync.missed_before()};
      break;
    }
    case Kind::kCaughtUp:
      event.what = CaughtUp{message.caught_up().journal_sequence(), message.caught_up().time_us()};
      break;
    case Kind::kFrameAdded:
    case Kind::kLabelChanged:
    case Kind::EVENT_NOT_SET:
      return {Reason::UNSUPPORTED, "an event of another version"};
  }
  return {};
}

}  // namespace

Result<std::optional<WatchEvent>> read_event(const v1::MapEvent& message) {
  WatchEvent event;
  const Status read = read_what(message, event);
  if (read.reason() == Reason::UNSUPPORTED) return std::optional<WatchEvent>();
  if (!read.ok()) return read;
  event.resume_token = message.resume_token();
  event.time_us = message.time_us();
  event.author = message.author();
  event.journal_sequence = message.journal_sequence();
  event.note = message.note();
  return std::optional<WatchEvent>(std::move(event));
}

}  // namespace relmap::client
