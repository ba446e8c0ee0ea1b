#include "tools/relmap/time_option.h"

#include <chrono>
#include <cmath>
#include <regex>

namespace relmap::cli {

namespace {

// The time that `match` tells: year, month, day, and perhaps hour, minute, second.
Result<std::int64_t> time_of(const std::smatch& match, const std::string& text) {
  const auto number = [&](std::size_t group) { return match[group].matched ? std::stoi(match[group].str()) : 0; };
  const std::chrono::year_month_day day(std::chrono::year(number(1)),
                                        std::chrono::month(static_cast<unsigned>(number(2))),
                                        std::chrono::day(static_cast<unsigned>(number(3))));
  const double seconds = match[6].matched ? std::stod(match[6].str()) : 0;
  if (!day.ok() || number(4) > 23 || number(5) > 59 || seconds >= 60)
    return {Reason::INVALID_ARGUMENT, "there is no time " + text};
  const auto days = std::chrono::sys_days(day).time_since_epoch().count();
  return ((static_cast<std::int64_t>(days) * 24 + number(4)) * 60 + number(5)) * 60'000'000 +
         std::llround(seconds * 1e6);
}

}  // namespace

std::int64_t now_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

Result<std::int64_t> parse_time(const std::string& text, std::int64_t now_us) {
  static const std::regex kTime(R"((\d{4})-(\d\d)-(\d\d)(?:[T ](\d\d):(\d\d)(?::(\d\d(?:\.\d{1,6})?))?)?Z?)");
  static const std::regex kAgo(R"((\d{1,6}(?:\.\d{1,6})?)(s|min|h|d))");
  std::smatch match;
  if (std::regex_match(text, match, kTime)) return time_of(match, text);
  if (std::regex_match(text, match, kAgo)) {
    const std::string unit = match[2];
    const double seconds = unit == "s" ? 1 : unit == "min" ? 60 : unit == "h" ? 3600 : 86400;
    return now_us - std::llround(std::stod(match[1].str()) * seconds * 1e6);
  }
  return {Reason::INVALID_ARGUMENT,
          "'" + text + "' is no time; write 2026-11-30, 2026-11-30T08:15:00Z (UTC), or 2h for two hours ago"};
}

}  // namespace relmap::cli
