// What the process of a camera on IEEE 1394 is asked, and what it tells: packets of one size each way, in the byte
// order of the machine that both run on. It greets, answers every request once, and tells of frames and faults unasked.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/base/status.h"

namespace relmap::iidc::dc1394 {

inline constexpr std::uint32_t kProtocolVersion = 1;
inline constexpr int kProtocolFile = 3;          // the process's end of the socket pair
inline constexpr std::size_t kMaxValues = 64;    // of a message; a bus has 63 nodes
inline constexpr std::size_t kMaxQuadlets = 16;  // of a request

enum class Ask : std::uint32_t {
  kList = 1,   // the GUIDs of all cameras that libdc1394 finds
  kOpen = 2,   // `subject`: the GUID; once. Answered with its place, as text
  kRead = 3,   // `subject`: the address; `count`: quadlets
  kWrite = 4,  // `subject`: the address; `amount`: the quadlet
  kStart = 5,  // `amount`: bytes of a frame; `subject`: of its pixels, which no frame has fewer of; `count`: slots of
               // the frame ring, whose memory file comes with it
  kStop = 6,
};

struct Request {
  Ask ask = Ask::kList;
  std::uint32_t number = 0;  // repeated in the answer
  std::uint64_t subject = 0;
  std::uint64_t amount = 0;
  std::uint32_t count = 0;
  std::uint32_t unused = 0;
};

enum class Tell : std::uint32_t {
  kHello = 1,   // values: kProtocolVersion
  kAnswer = 2,  // of request `number`; values: as asked for
  kFrame = 3,   // values: slot of the ring, bytes, arrival (us, UTC), frames dropped before it for want of a slot
  kFault = 4,   // a frame is lost; CAMERA_GONE: and no other will come
};

struct Message {
  Tell tell = Tell::kHello;
  std::uint32_t number = 0;
  Reason reason = Reason::OK;
  std::uint16_t count = 0;  // of values
  std::uint32_t unused = 0;
  std::array<std::uint64_t, kMaxValues> values{};
  std::array<char, 192> text{};  // ends with 0

  static Message hello();
  static Message answer(std::uint32_t number, const Status& status);
  static Message frame(std::uint32_t slot, std::size_t bytes, std::int64_t arrival_us, std::uint64_t overrun);
  static Message fault(const Status& status);

  Message& with(std::span<const std::uint64_t> numbers);  // kMaxValues at most; more are left out
  Message& with(std::string_view words);                  // cut where it is too long
  Status status() const;
};

template <typename Packet>
std::span<const std::uint8_t> bytes_of(const Packet& packet) {
  return {reinterpret_cast<const std::uint8_t*>(&packet), sizeof packet};
}

// CORRUPT: it is none, and why. What a message says of a request or of a frame is not looked at.
Result<Request> parse_request(std::span<const std::uint8_t> bytes);
Result<Message> parse_message(std::span<const std::uint8_t> bytes);

}  // namespace relmap::iidc::dc1394
