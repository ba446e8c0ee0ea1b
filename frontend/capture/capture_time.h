// Parses the times in files and file names of data sets, to microseconds.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace relmap::capture {

// Relative times of data sets count from this moment: 2020-01-01 00:00:00 UTC.
inline constexpr std::int64_t kRelativeTimeBaseUs = 1'577'836'800'000'000;

// Times in UTC. A time below 10^9 s (2001) is relative and added to the base. Nothing if the text is no number,
// negative, or beyond 4 * 10^9 s (2096).
std::optional<std::int64_t> time_from_seconds(std::string_view text);
std::optional<std::int64_t> time_from_nanoseconds(std::string_view digits);

// The unit follows from the number of digits: 19 for nanoseconds, 16 for microseconds, 13 for milliseconds since 1970.
// Nothing for any other number of digits.
std::optional<std::int64_t> time_from_stamp(std::string_view digits);

}  // namespace relmap::capture
