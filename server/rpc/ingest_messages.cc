#include "server/rpc/ingest_messages.h"

#include "proto/keyframe/refusal_text.h"
#include "proto/wire/channels.h"
#include "proto/wire/convert.h"

namespace relmap::rpc {

v1::Welcome welcome_message(const DaemonIdentity& daemon) {
  v1::Welcome message;
  message.mutable_protocol()->set_major(kProtocolMajor);
  message.mutable_protocol()->set_minor(kProtocolMinor);
  message.set_boot_id(daemon.boot.data(), daemon.boot.size());
  if (!daemon.map.known()) return message;
  message.set_map_uuid(uuid_to_wire(daemon.map.uuid));
  message.set_map_epoch(daemon.map.epoch);
  return message;
}

v1::Acknowledgement acknowledgement_message(const Acknowledgement& ack) {
  v1::Acknowledgement message;
  message.set_session_uuid(uuid_to_wire(ack.session));
  message.set_boot_id(ack.boot.data(), ack.boot.size());
  message.set_next_sequence(ack.next_sequence);
  const auto put_ranges = [](const std::vector<SequenceRange>& ranges, auto& field) {
    for (const SequenceRange& range : ranges) {
      v1::SequenceRange& added = *field.Add();
      added.set_first(range.from);
      added.set_last(range.to);
    }
  };
  put_ranges(ack.held, *message.mutable_held());
  put_ranges(ack.missing, *message.mutable_missing());
  for (const Refused& refused : ack.refused) {
    v1::Refusal& added = *message.add_refused();
    added.set_sequence(refused.sequence);
    added.set_crc32c(refused.payload_crc);
    added.set_reason(to_wire(refused.reason));
    added.set_message(std::string(refusal_text(refused.reason)));
  }
  message.set_credits(ack.credits);
  message.set_session(ack.number);
  return message;
}

v1::IngestReply news_message(const PoseNews& news) {
  v1::IngestReply reply;
  const std::string uuid = uuid_to_wire(news.session);
  switch (news.kind) {
    case PoseNews::Kind::kSlowDown:
    case PoseNews::Kind::kResume:
      reply.mutable_pace()->set_session_uuid(uuid);
      reply.mutable_pace()->set_rate_hz(news.kind == PoseNews::Kind::kSlowDown ? news.rate_hz : 0);
      return reply;
    case PoseNews::Kind::kEnded:
      reply.mutable_ended()->set_session_uuid(uuid);
      return reply;
    case PoseNews::Kind::kLocalised:
    case PoseNews::Kind::kClosure:
    case PoseNews::Kind::kClosureOut:
      break;
  }
  v1::Localisation& found = *reply.mutable_localisation();
  found.set_session_uuid(uuid);
  found.set_sequence(news.keyframe.index);
  found.set_session(news.keyframe.session);
  *found.mutable_frame() = to_wire(news.frame);
  *found.mutable_frame_from_keyframe() = to_wire(news.T_frame_keyframe);
  *found.mutable_covariance() = to_wire(news.covariance);
  found.set_withdrawn(news.kind == PoseNews::Kind::kClosureOut);
  found.set_candidate(news.kind == PoseNews::Kind::kLocalised);
  return reply;
}

Result<Gap> read_gap(const v1::Gap& message) {
  const auto uuid = uuid_from_wire(message.session_uuid());
  if (!uuid.ok()) return uuid.status();
  return Gap{*uuid, message.first(), message.last(), reason_from_wire(message.reason())};
}

Result<SessionEnd> read_end(const v1::SessionEnd& message) {
  const auto uuid = uuid_from_wire(message.session_uuid());
  if (!uuid.ok()) return uuid.status();
  return SessionEnd{*uuid, message.next_sequence()};
}

}  // namespace relmap::rpc
