#include "proto/base/time_text.h"

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

}  // namespace relmap
