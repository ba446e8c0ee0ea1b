// The time of day as text.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace relmap {

// Microseconds since 1970 as RFC 3339 in UTC: "2026-03-04T05:06:07.089Z".
std::string time_text(std::int64_t time_us);
// Reads what time_text() wrote; nullopt if it is something else.
std::optional<std::int64_t> time_of_text(std::string_view text);

}  // namespace relmap
