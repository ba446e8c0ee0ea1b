// A file of a stereo camera's raw frames, with everything that is needed to use them on another machine.
//
// A log has "RELMAPRW", a u32 version, and records. A record has a head of 40 bytes and a body, each with a checksum.
// The first two records are two copies of the header; frames and events follow in the order of their arrival. Records
// are only ever appended, and each begins with a sync word, by which the next one is found behind a damaged stretch.
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
  std::string vendor, model, serial;  // as the camera states them; at most 255 bytes of each are kept
  StereoLayout layout;
  std::uint32_t embedded = 0;  // what the first bytes of a frame hold instead of pixels; 0 for nothing
  double rate_hz = 0;          // nominal; 0 if not known
  std::optional<StereoCalibration> calibration;
  std::int64_t begun_us = 0;  // UTC; 0 means the time when the log is opened
};

// A frame without its bytes.
struct RawLogFrame {
  std::int64_t time_us = 0;            // UTC
  std::optional<std::uint32_t> cycle;  // the camera's own stamp, in its own units
  std::uint64_t index = 0;             // among all frames that the camera sent, so that gaps are visible
};

// A fault of the camera, or a gap.
struct RawLogEvent {
  std::int64_t time_us = 0;  // UTC
  Reason reason = Reason::CAPTURE_FAILED;
  std::string message;     // at most kMaxMessage bytes are kept
  std::uint64_t lost = 0;  // number of frames lost by it; 0 if none, or if the number is not known
};

inline constexpr std::size_t kMaxFrameBytes = std::size_t{64} << 20;  // of a frame
inline constexpr std::size_t kMaxMessage = 1024;

// Whether a file begins like a raw log.
bool is_raw_log(const std::string& path);

// The encoding of a log, for writer and reader.
namespace raw_log {

inline constexpr std::size_t kBeginBytes = 12;  // magic and version
inline constexpr std::size_t kHeadBytes = 40;

enum class Kind : std::uint8_t { kHeader = 1, kFrame = 2, kEvent = 3 };  // other values are skipped (later versions)

// The head of a record.
struct Head {
  Kind kind = Kind::kFrame;
  Reason reason = Reason::OK;          // event only
  std::uint32_t bytes = 0, crc = 0;    // of the body
  std::int64_t time_us = 0;            // for a header, when the log was begun
  std::uint64_t number = 0;            // index of a frame, or number of frames lost by an event
  std::optional<std::uint32_t> cycle;  // frame only

  bool operator==(const Head&) const = default;
};

Bytes encode_begin();
// CORRUPT if it is no raw log; UNKNOWN_FORMAT_VERSION.
Status check_begin(ByteSpan begin);

Bytes encode_head(const Head& head);
// Nothing if there is no head of a record, or a damaged one.
std::optional<Head> decode_head(ByteSpan bytes);
// The position of the next sync word in `bytes`, from `from` on; bytes.size() if there is none.
std::size_t find_sync(ByteSpan bytes, std::size_t from);

Bytes encode_header(const RawLogHeader& header);
// CORRUPT, BAD_SIZE.
Result<RawLogHeader> decode_header(const Head& head, ByteSpan body);

// "1 frame", "12 frames", for messages about a log.
inline std::string plural(std::uint64_t count, const std::string& of) {
  return std::to_string(count) + ' ' + of + (count == 1 ? "" : "s");
}

}  // namespace raw_log

}  // namespace relmap::capture
