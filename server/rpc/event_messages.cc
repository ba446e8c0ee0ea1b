#include "server/rpc/event_messages.h"

#include "proto/wire/convert.h"
#include "server/rpc/messages.h"

namespace relmap::rpc {

namespace {

void put(const storage::SessionEvent& event, v1::MapEvent& message) {
  v1::Session& session = *message.mutable_session_changed();
  session.set_number(event.session);
  session.set_uuid(event.uuid.to_string());
  session.set_robot(event.robot);
  session.set_name(event.display_name);
  session.set_state(static_cast<v1::SessionState>(event.state));
}

void put(const storage::SkippedEvent& event, v1::MapEvent& message) {
  v1::SkippedSequences& skipped = *message.mutable_skipped();
  skipped.set_session(event.session);
  skipped.set_first(event.skipped.from);
  skipped.set_last(event.skipped.to);
  skipped.set_reason(to_wire(event.skipped.reason));
  skipped.set_refused(event.skipped.refused);
}

void put(const storage::FramesRemovedEvent& event, v1::MapEvent& message) {
  message.mutable_frames_removed()->set_session(event.session);
  message.mutable_frames_removed()->set_first(event.first);
}

void put(const storage::SessionDeletedEvent& event, v1::MapEvent& message) {
  message.mutable_session_deleted()->set_session(event.session);
  message.mutable_session_deleted()->set_uuid(event.uuid.to_string());
}

void put(const storage::ClosureEvent& event, v1::MapEvent& message) {
  v1::Edge& edge = *message.mutable_edge_changed();
  *edge.mutable_id() = to_wire(event.id);
  *edge.mutable_a() = to_wire(event.a);
  *edge.mutable_b() = to_wire(event.id.frame);
  edge.set_kind(to_wire(event.kind));
  edge.set_state(to_wire(event.state));
  edge.set_reason(to_wire(event.reason));
  edge.set_carries(event.carries);
  *edge.mutable_a_from_b() = to_wire(event.T_ab);
  edge.set_verification(to_wire(event.verification));
  edge.set_inliers(event.inliers);
  edge.set_probability(event.probability);
  edge.set_spread(event.spread);
}

void put(const storage::ClosureRemovedEvent& event, v1::MapEvent& message) {
  *message.mutable_edge_removed()->mutable_edge() = to_wire(event.id);
}

void put(const storage::LabelsEvent& event, v1::MapEvent& message) {
  v1::FrameLabels& labels = *message.mutable_frame_labels();
  *labels.mutable_frame() = to_wire(event.frame);
  labels.mutable_labels()->Add(event.labels.begin(), event.labels.end());
}

void put(const storage::FrameAddedEvent&, v1::MapEvent&) {}
void put(const storage::FramesMovedEvent&, v1::MapEvent&) {}

}  // namespace

v1::MapEvent event_message(const storage::Event& event) {
  v1::MapEvent message;
  std::visit([&](const auto& content) { put(content, message); }, event.content);
  // Records of a robot's own stream do not say when they were submitted.
  message.set_time_us(event.submitted.time_us != 0 ? event.submitted.time_us : event.committed_us);
  message.set_author(author_name(event.submitted.author));
  message.set_journal_sequence(event.at.sequence);
  message.set_note(event.note);
  return message;
}

v1::AddedFrame added_frame_message(const storage::FrameAddedEvent& frame) {
  v1::AddedFrame message;
  *message.mutable_frame() = to_wire(frame.frame);
  message.set_time_us(frame.time_us);
  if (frame.T_previous_frame) *message.mutable_previous_from_this() = to_wire(*frame.T_previous_frame);
  message.set_source(static_cast<v1::MotionSource>(frame.source));
  return message;
}

}  // namespace relmap::rpc
