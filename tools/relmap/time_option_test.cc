#include "tools/relmap/time_option.h"

#include <gtest/gtest.h>

#include "proto/base/time_text.h"

namespace relmap::cli {
namespace {

constexpr std::int64_t kNow = 1'796'000'000'000'000;

std::string read(const std::string& text) { return time_text(parse_time(text, kNow).or_throw()); }

TEST(TimeOption, ReadsTimesInUtc) {
  EXPECT_EQ(read("2026-11-30"), "2026-11-30T00:00:00.000Z");
  EXPECT_EQ(read("2026-11-30T08:15"), "2026-11-30T08:15:00.000Z");
  EXPECT_EQ(read("2026-11-30 08:15:12Z"), "2026-11-30T08:15:12.000Z");
  EXPECT_EQ(read("2026-11-30T08:15:12.345Z"), "2026-11-30T08:15:12.345Z");
  EXPECT_EQ(read("2024-02-29"), "2024-02-29T00:00:00.000Z");
}

TEST(TimeOption, ReadsHowLongAgo) {
  EXPECT_EQ(parse_time("90s", kNow).or_throw(), kNow - 90'000'000);
  EXPECT_EQ(parse_time("1.5h", kNow).or_throw(), kNow - 5'400'000'000);
  EXPECT_EQ(parse_time("15min", kNow).or_throw(), kNow - 900'000'000);
  EXPECT_EQ(parse_time("2d", kNow).or_throw(), kNow - 2 * 86'400'000'000);
}

TEST(TimeOption, RefusesWhatIsNoTime) {
  for (const char* text : {"", "yesterday", "2026-13-01", "2026-02-30", "2026-11-30T24:00", "2026-11-30T08:60",
                           "2h ago", "-2h", "2026-11-30T08:15:60", "2026-11-30T08", "99999999999d"})
    EXPECT_EQ(parse_time(text, kNow).reason(), Reason::INVALID_ARGUMENT) << text;
}

}  // namespace
}  // namespace relmap::cli
