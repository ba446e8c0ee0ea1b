// Any bytes as a request to a camera's process, and as a message of it: what is taken is a packet that is taken again,
// and so is each message that is made of its fields.
#include <array>

#include "frontend/capture/dc1394/protocol.h"
#include "proto/base/testing/fuzzing.h"

namespace {

using namespace relmap;
using namespace relmap::iidc::dc1394;
using fuzzing::must;

void check(const Message& made) {
  const auto parsed = parse_message(bytes_of(made));
  must(parsed.ok() && parsed->tell == made.tell && parsed->number == made.number && parsed->reason == made.reason);
  must(parsed->count == made.count && parsed->values == made.values);
  must(parsed->status().message().size() < parsed->text.size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const ByteSpan bytes(data, size);
  if (const auto request = parse_request(bytes); request.ok()) must(parse_request(bytes_of(*request)).ok());
  const auto message = parse_message(bytes);
  if (!message.ok()) return 0;
  check(*message);
  check(Message::hello());
  const Status status = message->status();
  check(Message::answer(message->number, status).with(message->values));
  const auto& v = message->values;
  check(Message::frame(static_cast<std::uint32_t>(v[0]), v[1], static_cast<std::int64_t>(v[2]), v[3]));
  check(Message::fault(status.ok() ? Status(Reason::CAMERA_GONE, "unplugged") : status));
  return 0;
}
