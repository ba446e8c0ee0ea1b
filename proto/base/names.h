// Names for display: of robots and sessions, and labels.
#pragma once

#include <string_view>

#include "proto/base/status.h"

namespace relmap {

inline constexpr std::size_t kMaxNameBytes = 64;

// BAD_NAME unless `text` is 1..64 bytes of well-formed UTF-8 (RFC 3629) without control characters and with something
// other than white space. `what` begins the message: "robot", "label".
Status check_name(std::string_view what, std::string_view text);

// BAD_NAME unless `text` is well-formed UTF-8 of at most `max_bytes` bytes without control characters, which would do
// what they say to whatever terminal it is read at. It may be empty.
Status check_line(std::string_view what, std::string_view text, std::size_t max_bytes);

// The robot of recordings that name none, set by `relmap ingest`. Several such recordings may be ingested at a time, so
// sessions of this name are not reported as two robots of one name.
inline constexpr char kUsualRobot[] = "batch";

}  // namespace relmap
