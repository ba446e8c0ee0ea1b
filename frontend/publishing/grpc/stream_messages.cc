#include "frontend/publishing/grpc/stream_messages.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "proto/wire/channels.h"
#include "proto/wire/convert.h"
#include "relmap/v1/ingest.pb.h"

namespace relmap::publishing {

namespace {

constexpr std::uint64_t kMaxSequences = std::uint64_t{1} << 32;

Status malformed(const char* what) { return {Reason::CORRUPT, std::string("malformed ") + what}; }

Result<BootId> read_boot(const std::string& bytes) {
  BootId boot;
  if (bytes.size() != boot.size()) return malformed("boot id");
  std::copy(bytes.begin(), bytes.end(), boot.begin());
  return boot;
}

using Ranges = google::protobuf::RepeatedPtrField<v1::SequenceRange>;

// Ranges must ascend without touching each other.
Result<std::vector<SequenceRange>> read_ranges(const Ranges& messages) {
  std::vector<SequenceRange> ranges;
  for (const v1::SequenceRange& message : messages) {
    if (message.first() > message.last() || (!ranges.empty() && message.first() <= ranges.back().to))
      return malformed("ranges of sequences");
    ranges.push_back({message.first(), message.last()});
  }
  return ranges;
}

Status read_localisation(const v1::Localisation& message, PoseNews& news) {
  v1::FrameId keyframe;
  keyframe.set_session(message.session());
  keyframe.set_index(message.sequence());
  const auto frame = from_wire(message.frame()), of_session = from_wire(keyframe);
  const auto T = from_wire(message.frame_from_keyframe());
  const auto covariance = from_wire(message.covariance());
  for (const Status& status : {frame.status(), of_session.status(), T.status(), covariance.status()})
    if (!status.ok()) return status;
  news.kind = message.withdrawn()   ? PoseNews::Kind::kClosureOut
              : message.candidate() ? PoseNews::Kind::kLocalised
                                    : PoseNews::Kind::kClosure;
  news.keyframe = *of_session;
  news.frame = *frame;
  news.T_frame_keyframe = *T;
  news.covariance = *covariance;
  return {};
}

Status read_pace(const v1::Pace& message, PoseNews& news) {
  if (!(message.rate_hz() >= 0) || !std::isfinite(message.rate_hz())) return malformed("pace");
  news.kind = message.rate_hz() > 0 ? PoseNews::Kind::kSlowDown : PoseNews::Kind::kResume;
  news.rate_hz = message.rate_hz();
  return {};
}

}  // namespace

v1::IngestRequest hello_request(const std::string& robot) {
  v1::IngestRequest request;
  v1::Hello& hello = *request.mutable_hello();
  hello.mutable_protocol()->set_major(kProtocolMajor);
  hello.mutable_protocol()->set_minor(kProtocolMinor);
  hello.set_robot(robot);
  return request;
}

v1::IngestRequest keyframe_request(const KeyframePart& whole) {
  v1::IngestRequest request;
  v1::KeyframePayload& keyframe = *request.mutable_keyframe();
  keyframe.set_session_uuid(uuid_to_wire(whole.session));
  keyframe.set_sequence(whole.sequence);
  keyframe.set_crc32c(whole.payload_crc);
  keyframe.set_payload(whole.data.data(), whole.data.size());
  return request;
}

v1::IngestRequest gap_request(const Gap& gap) {
  v1::IngestRequest request;
  v1::Gap& message = *request.mutable_gap();
  message.set_session_uuid(uuid_to_wire(gap.session));
  message.set_first(gap.from);
  message.set_last(gap.to);
  message.set_reason(to_wire(gap.reason));
  return request;
}

v1::IngestRequest end_request(const SessionEnd& end) {
  v1::IngestRequest request;
  v1::SessionEnd& message = *request.mutable_end();
  message.set_session_uuid(uuid_to_wire(end.session));
  message.set_next_sequence(end.next_sequence);
  return request;
}

Result<DaemonIdentity> read_welcome(const v1::Welcome& welcome) {
  if (welcome.protocol().major() != kProtocolMajor)
    return {Reason::UNKNOWN_PROTOCOL_VERSION, "the daemon speaks protocol " +
                                                  std::to_string(welcome.protocol().major()) +
                                                  "; known: " + std::to_string(kProtocolMajor)};
  const auto boot = read_boot(welcome.boot_id());
  if (!boot.ok()) return boot.status();
  DaemonIdentity daemon{*boot, {}};
  if (welcome.map_uuid().empty()) return daemon;  // an older daemon
  const auto uuid = uuid_from_wire(welcome.map_uuid());
  if (!uuid.ok()) return uuid.status();
  daemon.map = {*uuid, welcome.map_epoch()};
  return daemon;
}

Result<Acknowledgement> read_acknowledgement(const v1::Acknowledgement& message) {
  const auto session = uuid_from_wire(message.session_uuid());
  const auto boot = read_boot(message.boot_id());
  auto held = read_ranges(message.held()), missing = read_ranges(message.missing());
  for (const Status& status : {session.status(), boot.status(), held.status(), missing.status()})
    if (!status.ok()) return status;
  if (message.next_sequence() > kMaxSequences) return malformed("acknowledgement");
  Acknowledgement ack;
  ack.session = *session;
  ack.boot = *boot;
  ack.next_sequence = message.next_sequence();
  ack.number = message.session();
  ack.held = *std::move(held);
  ack.missing = *std::move(missing);
  for (const v1::Refusal& refusal : message.refused())
    ack.refused.push_back({refusal.sequence(), refusal.crc32c(), reason_from_wire(refusal.reason())});
  ack.credits = message.credits();
  return ack;
}

Result<PoseNews> read_news(const v1::IngestReply& reply, const BootId& boot) {
  PoseNews news;
  news.boot = boot;
  news.time_us =
      std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
          .count();
  const auto of_session = [&](const std::string& bytes) -> Status {
    const auto session = uuid_from_wire(bytes);
    if (session.ok()) news.session = *session;
    return session.status();
  };
  Status read, session;
  switch (reply.content_case()) {
    case v1::IngestReply::kLocalisation:
      session = of_session(reply.localisation().session_uuid());
      read = read_localisation(reply.localisation(), news);
      break;
    case v1::IngestReply::kPace:
      session = of_session(reply.pace().session_uuid());
      read = read_pace(reply.pace(), news);
      break;
    case v1::IngestReply::kEnded:
      session = of_session(reply.ended().session_uuid());
      news.kind = PoseNews::Kind::kEnded;
      break;
    default:
      return malformed("reply");
  }
  if (!session.ok()) return session;
  if (!read.ok()) return read;
  return news;
}

}  // namespace relmap::publishing
