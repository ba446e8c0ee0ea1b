#include "proto/base/time_text.h"

#include <charconv>
#include <ctime>

#include "proto/base/printf_text.h"

namespace relmap {

std::string time_text(std::int64_t time_us) {
  const std::time_t seconds = time_us / 1'000'000;
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char text[40];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &utc);
  return text + printf_text(".%03dZ", static_cast<int>(time_us / 1000 % 1000));
}

std::optional<std::int64_t> time_of_text(std::string_view text) {
  constexpr std::string_view kForm = "0000-00-00T00:00:00.000Z";
  if (text.size() != kForm.size()) return std::nullopt;
  for (std::size_t i = 0; i < kForm.size(); ++i)
    if (kForm[i] == '0' ? text[i] < '0' || text[i] > '9' : text[i] != kForm[i]) return std::nullopt;
  const auto number = [text](std::size_t begin, std::size_t size) {
    int value = 0;
    std::from_chars(text.data() + begin, text.data() + begin + size, value);
    return value;
  };
  std::tm utc{};
  utc.tm_year = number(0, 4) - 1900;
  utc.tm_mon = number(5, 2) - 1;
  utc.tm_mday = number(8, 2);
  utc.tm_hour = number(11, 2);
  utc.tm_min = number(14, 2);
  utc.tm_sec = number(17, 2);
  const std::int64_t time_us = std::int64_t{timegm(&utc)} * 1'000'000 + std::int64_t{number(20, 3)} * 1000;
  return time_text(time_us) == text ? std::optional(time_us) : std::nullopt;  // not on the 31st of February
}

}  // namespace relmap
