#include "frontend/capture/dc1394/protocol.h"

#include <algorithm>
#include <cstring>
#include <type_traits>

namespace relmap::iidc::dc1394 {

namespace {

static_assert(std::is_trivially_copyable_v<Request> && sizeof(Request) == 32);
static_assert(std::is_trivially_copyable_v<Message> && sizeof(Message) == 16 + 8 * kMaxValues + 192);

template <typename Packet>
Status copy(std::span<const std::uint8_t> bytes, Packet& packet) {
  if (bytes.size() != sizeof packet)
    return {Reason::CORRUPT,
            "a packet of " + std::to_string(bytes.size()) + " bytes instead of " + std::to_string(sizeof packet)};
  std::memcpy(&packet, bytes.data(), sizeof packet);
  return {};
}

// The field as a number, since an enumeration that was received as bytes may have any value.
template <typename Field>
auto raw(const Field& field) {
  std::underlying_type_t<Field> number;
  std::memcpy(&number, &field, sizeof number);
  return number;
}

}  // namespace

Message Message::hello() {
  Message message;
  message.tell = Tell::kHello;
  return message.with(std::array<std::uint64_t, 1>{kProtocolVersion});
}

Message Message::answer(std::uint32_t number, const Status& status) {
  Message message;
  message.tell = Tell::kAnswer;
  message.number = number;
  message.reason = status.reason();
  return message.with(status.message());
}

Message Message::frame(std::uint32_t slot, std::size_t bytes, std::int64_t arrival_us, std::uint64_t overrun) {
  Message message;
  message.tell = Tell::kFrame;
  return message.with(std::array<std::uint64_t, 4>{slot, bytes, static_cast<std::uint64_t>(arrival_us), overrun});
}

Message Message::fault(const Status& status) {
  Message message = answer(0, status);
  message.tell = Tell::kFault;
  return message;
}

Message& Message::with(std::span<const std::uint64_t> numbers) {
  count = static_cast<std::uint16_t>(std::min(numbers.size(), values.size()));
  std::copy_n(numbers.begin(), count, values.begin());
  return *this;
}

Message& Message::with(std::string_view words) {
  text.fill(0);
  std::copy_n(words.begin(), std::min(words.size(), text.size() - 1), text.begin());
  return *this;
}

Status Message::status() const { return reason == Reason::OK ? Status() : Status(reason, text.data()); }

Result<Request> parse_request(std::span<const std::uint8_t> bytes) {
  Request request;
  if (Status status = copy(bytes, request); !status.ok()) return status;
  const std::uint32_t ask = raw(request.ask);
  if (ask < raw(Ask::kList) || ask > raw(Ask::kStop))
    return {Reason::CORRUPT, "request " + std::to_string(ask) + " is none"};
  return request;
}

Result<Message> parse_message(std::span<const std::uint8_t> bytes) {
  Message message;
  if (Status status = copy(bytes, message); !status.ok()) return status;
  const std::uint32_t tell = raw(message.tell);
  if (tell < raw(Tell::kHello) || tell > raw(Tell::kFault))
    return {Reason::CORRUPT, "message " + std::to_string(tell) + " is none"};
  const std::uint16_t reason = raw(message.reason);
  if (!is_reason(reason)) return {Reason::CORRUPT, "reason " + std::to_string(reason) + " is none"};
  if (message.count > kMaxValues) return {Reason::CORRUPT, std::to_string(message.count) + " values are too many"};
  const std::size_t values = message.tell == Tell::kHello ? 1 : message.tell == Tell::kFrame ? 4 : 0;
  if (message.count < values) return {Reason::CORRUPT, std::to_string(message.count) + " values are too few"};
  if (message.tell == Tell::kFault && message.reason == Reason::OK)
    return {Reason::CORRUPT, "a fault without a reason"};
  message.text.back() = 0;
  for (char& letter : message.text)  // it is shown on terminals
    if (letter != 0 && (letter < ' ' || letter > '~')) letter = '?';
  return message;
}

}  // namespace relmap::iidc::dc1394
