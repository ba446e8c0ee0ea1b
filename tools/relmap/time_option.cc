#include "tools/relmap/time_option.h"

#include <cmath>
#include <regex>

#include "proto/base/time_text.h"

namespace relmap::cli {

Result<std::int64_t> parse_time(const std::string& text, std::int64_t now_us) {
  static const std::regex kTime(R"((\d{4}-(\d\d)-(\d\d))(?:[T ](\d\d):(\d\d)(?::(\d\d(?:\.\d{1,6})?))?)?Z?)");
  static const std::regex kAgo(R"((\d{1,6}(?:\.\d{1,6})?)(s|min|h|d))");
  std::smatch match;
  if (std::regex_match(text, match, kTime)) {
    const auto part = [&](std::size_t group, const char* otherwise) {
      return match[group].matched ? match[group].str() : std::string(otherwise);
    };
    // As time_text() writes it, with milliseconds.
    const std::string seconds = (part(6, "00") + (part(6, "").size() > 2 ? "" : ".") + "000").substr(0, 6);
    if (const auto time = time_of_text(part(1, "") + "T" + part(4, "00") + ":" + part(5, "00") + ":" + seconds + "Z"))
      return *time;
    return {Reason::INVALID_ARGUMENT, "there is no time " + text};
  }
  if (std::regex_match(text, match, kAgo)) {
    const std::string unit = match[2];
    const double seconds = unit == "s" ? 1 : unit == "min" ? 60 : unit == "h" ? 3600 : 86400;
    return now_us - std::llround(std::stod(match[1].str()) * seconds * 1e6);
  }
  return {Reason::INVALID_ARGUMENT,
          "'" + text + "' is no time; write 2026-11-30, 2026-11-30T08:15:00Z (UTC), or 2h for two hours ago"};
}

}  // namespace relmap::cli
