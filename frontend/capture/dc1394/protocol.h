// The protocol with the process of a camera on IEEE 1394: packets of a fixed size in each direction, in the machine's
// byte order. The process sends a greeting, answers each request once, and sends frames and faults unrequested.
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
inline constexpr std::size_t kMaxValues = 64;    // in a message; a bus has 63 nodes
inline constexpr std::size_t kMaxQuadlets = 16;  // in a request

enum class Ask : std::uint32_t {
  kList = 1,   // list the GUIDs of all cameras that libdc1394 finds
  kOpen = 2,   // open the camera with GUID `subject`; only once. The answer has its place as text
  kRead = 3,   // read `count` quadlets from address `subject`
  kWrite = 4,  // write the quadlet `amount` to address `subject`
  // Start the stream: `amount` bytes a frame, of which at least `subject` are pixels, and `count` slots of the frame
  // ring, whose file descriptor comes with the request.
  kStart = 5,
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
  kHello = 1,   // greeting; values: kProtocolVersion
  kAnswer = 2,  // to request `number`; values: as requested
  kFrame = 3,   // values: slot of the ring, bytes, arrival (us, UTC), frames dropped before it for lack of a slot
  kFault = 4,   // a frame is lost; with CAMERA_GONE, no more will come
};

struct Message {
  Tell tell = Tell::kHello;
  std::uint32_t number = 0;
  Reason reason = Reason::OK;
  std::uint16_t count = 0;  // number of values
  std::uint32_t unused = 0;
  std::array<std::uint64_t, kMaxValues> values{};
  std::array<char, 192> text{};  // ends with 0

  static Message hello();
  static Message answer(std::uint32_t number, const Status& status);
  static Message frame(std::uint32_t slot, std::size_t bytes, std::int64_t arrival_us, std::uint64_t overrun);
  static Message fault(const Status& status);

  Message& with(std::span<const std::uint64_t> numbers);  // at most kMaxValues; the rest is dropped
  Message& with(std::string_view words);                  // truncated if it is too long
  Status status() const;
};

template <typename Packet>
std::span<const std::uint8_t> bytes_of(const Packet& packet) {
  return {reinterpret_cast<const std::uint8_t*>(&packet), sizeof packet};
}

// CORRUPT, with the cause, if the bytes are no valid packet. Whether a message fits a request or a frame is not
// checked.
Result<Request> parse_request(std::span<const std::uint8_t> bytes);
Result<Message> parse_message(std::span<const std::uint8_t> bytes);

}  // namespace relmap::iidc::dc1394
