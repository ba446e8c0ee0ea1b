// Names that people read: robots, sessions, labels.
#pragma once

#include <string_view>

#include "proto/base/status.h"

namespace relmap {

inline constexpr std::size_t kMaxNameBytes = 64;

// BAD_NAME unless `text` is 1..64 bytes of well-formed UTF-8 (RFC 3629) without control characters.
// `what` begins the message: "robot", "label".
Status check_name(std::string_view what, std::string_view text);

// The robot of a recording that names none. Many such recordings may be taken in at a time, so two of this name are
// never taken for the same robot.
inline constexpr char kUsualRobot[] = "batch";

}  // namespace relmap
