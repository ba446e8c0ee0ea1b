// Times that users type.
#pragma once

#include <cstdint>
#include <string>

#include "proto/base/status.h"

namespace relmap::cli {

// "2026-11-30", "2026-11-30T08:15", "2026-11-30T08:15:12.5Z": in UTC; or a time before `now_us`: "90s", "15min", "2h",
// "3d". Microseconds since 1970. INVALID_ARGUMENT.
Result<std::int64_t> parse_time(const std::string& text, std::int64_t now_us);

}  // namespace relmap::cli
