// Names that people read: robots, sessions, labels.
#pragma once

#include <string_view>

#include "proto/base/status.h"

namespace relmap {

inline constexpr std::size_t kMaxNameBytes = 64;

// BAD_NAME unless `text` is 1..64 bytes of well-formed UTF-8 (RFC 3629) without control characters.
// `what` begins the message: "robot", "label".
Status check_name(std::string_view what, std::string_view text);

}  // namespace relmap
