// The time of day as text.
#pragma once

#include <cstdint>
#include <string>

namespace relmap {

// Microseconds since 1970 as RFC 3339 in UTC: "2026-03-04T05:06:07.089Z".
std::string time_text(std::int64_t time_us);

}  // namespace relmap
