// Times of data sets, as their files and file names write them, in microseconds.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace relmap::capture {

// The moment at which data sets without absolute time are placed: 2020-01-01 00:00:00 UTC.
inline constexpr std::int64_t kRelativeTimeBaseUs = 1'577'836'800'000'000;

// UTC. Below 10^9 s (2001) a time is relative and placed at the base. Nothing if the text is no number, negative, or
// beyond 4 * 10^9 s (2096).
std::optional<std::int64_t> time_from_seconds(std::string_view text);
std::optional<std::int64_t> time_from_nanoseconds(std::string_view digits);

// By the number of digits: 19 nanoseconds, 16 microseconds, 13 milliseconds since 1970. Nothing otherwise.
std::optional<std::int64_t> time_from_stamp(std::string_view digits);

}  // namespace relmap::capture
