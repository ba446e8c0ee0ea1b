#include "proto/base/time_text.h"

#include <gtest/gtest.h>

namespace relmap {
namespace {

TEST(TimeText, IsReadBack) {
  EXPECT_EQ(time_text(1'772'600'767'089'999), "2026-03-04T05:06:07.089Z");
  EXPECT_EQ(time_of_text("2026-03-04T05:06:07.089Z"), 1'772'600'767'089'000);
  for (const std::int64_t time_us : {std::int64_t{0}, std::int64_t{951'782'400'000'000}, std::int64_t{1} << 51})
    EXPECT_EQ(time_of_text(time_text(time_us)), time_us / 1000 * 1000);
  for (const char* text : {"", "2026-03-04", "2026-03-04T05:06:07.089", "2026-02-31T05:06:07.089Z",
                           "2026-03-04 05:06:07.089Z", "2026-03-04T25:06:07.089Z", "2026-13-04T05:06:07.089Z"})
    EXPECT_FALSE(time_of_text(text).has_value()) << text;
}

}  // namespace
}  // namespace relmap
