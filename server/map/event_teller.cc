#include "server/map/event_teller.h"

#include <type_traits>
#include <utility>
#include <variant>

#include "server/map/map_builder.h"
#include "storage/graph/graph.h"

namespace relmap::map {
namespace {

// The session that the record is of; 0: of none.
SessionNumber session_of(const storage::JournalRecord& record) {
  return std::visit(
      [](const auto& r) -> SessionNumber {
        if constexpr (std::is_same_v<std::decay_t<decltype(r)>, storage::SessionRecord>)
          return r.number;
        else if constexpr (requires { r.session; })
          return r.session;
        else
          return 0;
      },
      record);
}

}  // namespace

EventTeller::SessionStanding EventTeller::standing(const storage::Session& session) {
  return {session.state, storage::is_deleted(session), session.refused + session.given_up, session.frames};
}

EventTeller::EventTeller(storage::Map& map, const storage::JournalRecord& record)
    : map_(map), number_(session_of(record)) {
  if (number_ != 0)
    if (const auto session = map_.session(number_)) before_ = standing(*session);
  if (const auto* edit = std::get_if<storage::SetLabelRecord>(&record))
    if (const auto frame = map_.hot(edit->frame)) {
      labelled_ = edit->frame;
      labels_ = frame->labels;
    }
}

void EventTeller::tell(std::uint64_t sequence, const storage::JournalRecord& record, const Applied& applied) {
  event_.at = {sequence, 0};
  if (const storage::Submission* submitted = storage::submission(record)) event_.submitted = *submitted;
  if (const auto* edit = std::get_if<storage::SetEdgeStateRecord>(&record)) event_.note = edit->note;
  tell_closures(applied);
  if (number_ != 0) tell_session(record);
  if (applied.frame) tell_frame(*applied.frame);
  if (labelled_)
    if (const auto frame = map_.hot(*labelled_); frame->labels != labels_)
      this->record(storage::LabelsEvent{*labelled_, frame->labels});
}

void EventTeller::record(storage::EventContent content) {
  event_.content = std::move(content);
  map_.record(event_);
  ++event_.at.ordinal;
}

void EventTeller::tell_session(const storage::JournalRecord& record) {
  const auto session = map_.session(number_);
  if (!session) return;
  const SessionStanding now = standing(*session);
  if (!before_ || before_->state != now.state)
    this->record(
        storage::SessionEvent{number_, session->header.uuid, session->header.robot, session->display_name, now.state});
  if (before_ && now.skipped > before_->skipped) {
    if (const auto* gap = std::get_if<storage::GapRecord>(&record))
      this->record(storage::SkippedEvent{number_, {gap->from, gap->to, 0, false, gap->reason}});
    if (const auto* refusal = std::get_if<storage::RefusalRecord>(&record))
      this->record(
          storage::SkippedEvent{number_, {refusal->sequence, refusal->sequence, refusal->crc, true, refusal->reason}});
  }
  if (before_ && std::holds_alternative<storage::RemoveChunkRecord>(record) && now.frames < before_->frames)
    this->record(storage::FramesRemovedEvent{number_, now.frames > 0 ? session->last + 1 : 0});
  if (now.deleted && !(before_ && before_->deleted))
    this->record(storage::SessionDeletedEvent{number_, session->header.uuid});
}

void EventTeller::tell_frame(FrameId frame) {
  const auto hot = map_.hot(frame);
  storage::FrameAddedEvent added;
  added.frame = frame;
  added.time_us = hot->time_us;
  if (const storage::Edge* motion = storage::motion_to(*hot)) {
    added.T_previous_frame = motion->T_ab;
    added.source = motion->source;
  }
  record(std::move(added));
}

void EventTeller::tell_closures(const Applied& applied) {
  for (const EdgeId id : applied.closures.deleted) record(storage::ClosureRemovedEvent{id});
  for (const EdgeId id : applied.closures.stand_in) tell_closure(id);
  for (const EdgeChange& change : applied.edges)
    if (change.kind == storage::EdgeKind::kLoop && change.after) tell_closure(change.id);
}

void EventTeller::tell_closure(EdgeId id) {
  const auto hot = map_.hot(id.frame);
  const storage::Edge& edge = *hot->edge(id);
  record(storage::ClosureEvent{edge.id, edge.a, edge.kind, edge.state, edge.reason, edge.carries, edge.T_ab,
                               edge.verification, edge.inliers, edge.probability, edge.spread});
}

}  // namespace relmap::map
