// Any bytes as what a daemon says on a stream of keyframes: it is read, or refused with a named reason. What a robot
// says there can be read, too. The first byte chooses the message.
#include <cmath>

#include "frontend/publishing/grpc/stream_messages.h"
#include "proto/base/testing/fuzzing.h"
#include "proto/wire/convert.h"
#include "relmap/v1/ingest.pb.h"

namespace {

using namespace relmap;
using fuzzing::must;

bool ascend(const std::vector<SequenceRange>& ranges) {
  for (std::size_t i = 0; i < ranges.size(); ++i)
    if (ranges[i].from > ranges[i].to || (i > 0 && ranges[i].from <= ranges[i - 1].to)) return false;
  return true;
}

void check_acknowledgement(const v1::Acknowledgement& message) {
  const auto ack = publishing::read_acknowledgement(message);
  if (!ack.ok()) {
    must(fuzzing::is_one_of(ack.reason(), {Reason::CORRUPT, Reason::INVALID_ARGUMENT}));
    return;
  }
  must(ack->next_sequence <= std::uint64_t{1} << 32 && ascend(ack->held) && ascend(ack->missing));
}

void check_news(const v1::IngestReply& message) {
  const auto news = publishing::read_news(message, BootId{1});
  if (!news.ok()) {
    must(news.reason() != Reason::INTERNAL && !news.status().message().empty());
    return;
  }
  must(news->boot == BootId{1} && news->rate_hz >= 0 && std::isfinite(news->rate_hz));
  if (news->of_frame()) must(news->T_frame_keyframe.t.allFinite() && news->covariance.allFinite());
}

v1::IngestRequest sent(const v1::IngestRequest& request) {
  v1::IngestRequest read;
  must(read.ParseFromString(request.SerializeAsString()));
  return read;
}

void say(ByteReader in) {
  SessionUuid session;
  session.bytes[0] = in.get<std::uint8_t>();
  session.bytes[1] = 1;  // no session is nil
  const auto number = in.get<std::uint32_t>();
  const ByteSpan payload = in.get_bytes(in.remaining());
  KeyframePart whole;
  whole.session = session;
  whole.sequence = number;
  whole.data.assign(payload.begin(), payload.end());
  const auto keyframe = sent(publishing::keyframe_request(whole)).keyframe();
  must(fuzzing::text_of(payload) == keyframe.payload() && keyframe.sequence() == number);
  must(uuid_from_wire(keyframe.session_uuid()).or_throw() == session);
  const auto gap = sent(publishing::gap_request({session, 0, number, Reason::DROPPED_BY_ROBOT})).gap();
  must(gap.last() == number && reason_from_wire(gap.reason()) == Reason::DROPPED_BY_ROBOT);
  must(sent(publishing::end_request({session, number})).end().next_sequence() == number);
  must(sent(publishing::hello_request("cart")).hello().robot() == "cart");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto parse = [&](auto& message) { return message.ParseFromArray(data + 1, static_cast<int>(size - 1)); };
  switch (data[0] % 4) {
    case 0: {
      v1::Welcome message;
      if (!parse(message)) break;
      const auto daemon = publishing::read_welcome(message);
      must(daemon.ok() || fuzzing::is_one_of(daemon.reason(), {Reason::CORRUPT, Reason::UNKNOWN_PROTOCOL_VERSION,
                                                               Reason::INVALID_ARGUMENT}));
      break;
    }
    case 1:
      if (v1::Acknowledgement message; parse(message)) check_acknowledgement(message);
      break;
    case 2:
      if (v1::IngestReply message; parse(message)) check_news(message);
      break;
    default:
      say(ByteReader({data + 1, size - 1}));
  }
  return 0;
}
