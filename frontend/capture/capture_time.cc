#include "frontend/capture/capture_time.h"

#include <charconv>
#include <cmath>

namespace relmap::capture {

namespace {

constexpr std::int64_t kFirstAbsoluteUs = 1'000'000'000'000'000, kLatestTimeUs = 4'000'000'000'000'000;

// The whole text as one number.
template <typename Number>
std::optional<Number> number_of(std::string_view text) {
  Number number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) return {};
  return number;
}

std::optional<std::int64_t> placed(std::int64_t time_us) {
  if (time_us < 0 || time_us > kLatestTimeUs) return {};
  return time_us + (time_us < kFirstAbsoluteUs ? kRelativeTimeBaseUs : 0);
}

}  // namespace

std::optional<std::int64_t> time_from_seconds(std::string_view text) {
  const auto seconds = number_of<double>(text);
  if (!seconds || !(*seconds >= 0 && *seconds <= 4e9)) return {};
  return placed(std::llround(*seconds * 1e6));
}

std::optional<std::int64_t> time_from_nanoseconds(std::string_view digits) {
  const auto nanoseconds = number_of<std::int64_t>(digits);
  if (!nanoseconds || *nanoseconds < 0) return {};
  return placed(*nanoseconds / 1000);
}

std::optional<std::int64_t> time_from_stamp(std::string_view digits) {
  if (digits.find_first_not_of("0123456789") != digits.npos) return {};
  if (digits.size() != 19 && digits.size() != 16 && digits.size() != 13) return {};
  const auto number = number_of<std::int64_t>(digits);
  if (!number) return {};
  return digits.size() == 19 ? *number / 1000 : digits.size() == 16 ? *number : *number * 1000;
}

}  // namespace relmap::capture
