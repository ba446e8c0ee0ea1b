// Raw frames of a stereo camera in a file, with all that is needed to see them again on another machine.
//
// A log is "RELMAPRW", a u32 version and records: a head of 40 bytes, which has a checksum of its own, and a body,
// which has another. The first two records are the header, twice; frames and events follow in the order they came.
// Records are only ever appended, and each begins with a sync word: the next one is found behind whatever is damaged.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "frontend/capture/stereo_layout.h"
#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "proto/calibration/calibration.h"

namespace relmap::capture {

struct RawLogHeader {
  std::string vendor, model, serial;  // of the camera, as it says itself; at most 255 bytes each are kept
  StereoLayout layout;
  std::uint32_t embedded = 0;  // what stands in the first bytes of a frame in the place of pixels; 0: nothing
  double rate_hz = 0;          // nominal; 0: not known
  std::optional<StereoCalibration> calibration;
  std::int64_t begun_us = 0;  // UTC; 0: when the log is opened
};

// A frame, but for its bytes.
struct RawLogFrame {
  std::int64_t time_us = 0;            // UTC
  std::optional<std::uint32_t> cycle;  // the camera's own stamp, in its own units
  std::uint64_t index = 0;             // among all that the camera sent: gaps show
};

// A fault of the camera, or a gap.
struct RawLogEvent {
  std::int64_t time_us = 0;  // UTC
  Reason reason = Reason::CAPTURE_FAILED;
  std::string message;     // at most kMaxMessage bytes are kept
  std::uint64_t lost = 0;  // frames, by it; 0: none, or it is not known how many
};

inline constexpr std::size_t kMaxFrameBytes = std::size_t{64} << 20;  // of a frame
inline constexpr std::size_t kMaxMessage = 1024;

// By its first bytes.
bool is_raw_log(const std::string& path);

// The bytes of a log, for who writes and who reads it.
namespace raw_log {

inline constexpr std::size_t kBeginBytes = 12;  // magic and version
inline constexpr std::size_t kHeadBytes = 40;

enum class Kind : std::uint8_t { kHeader = 1, kFrame = 2, kEvent = 3 };  // others: of a later version, passed over

// Of a record.
struct Head {
  Kind kind = Kind::kFrame;
  Reason reason = Reason::OK;          // of an event
  std::uint32_t bytes = 0, crc = 0;    // of the body
  std::int64_t time_us = 0;            // of a header when the log was begun
  std::uint64_t number = 0;            // of a frame its index, of an event the frames lost
  std::optional<std::uint32_t> cycle;  // of a frame

  bool operator==(const Head&) const = default;
};

Bytes encode_begin();
// CORRUPT: no raw log; UNKNOWN_FORMAT_VERSION.
Status check_begin(ByteSpan begin);

Bytes encode_head(const Head& head);
// Nothing: no head of a record, or a damaged one.
std::optional<Head> decode_head(ByteSpan bytes);
// Where in `bytes` the next sync word stands, from `from` on; bytes.size(): nowhere.
std::size_t find_sync(ByteSpan bytes, std::size_t from);

Bytes encode_header(const RawLogHeader& header);
// CORRUPT, BAD_SIZE.
Result<RawLogHeader> decode_header(const Head& head, ByteSpan body);

}  // namespace raw_log

}  // namespace relmap::capture
