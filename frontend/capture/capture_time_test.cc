#include "frontend/capture/capture_time.h"

#include <gtest/gtest.h>

namespace relmap::capture {
namespace {

TEST(CaptureTime, IsUtcOrPlacedAtTheBase) {
  EXPECT_EQ(time_from_seconds("1305031102.175304"), 1'305'031'102'175'304);
  EXPECT_EQ(time_from_seconds("1.25e-01"), kRelativeTimeBaseUs + 125'000);
  EXPECT_EQ(time_from_nanoseconds("1403715273262142976"), 1'403'715'273'262'142);
  EXPECT_EQ(time_from_nanoseconds("0"), kRelativeTimeBaseUs);
  EXPECT_EQ(time_from_nanoseconds("999999999999999999"), kRelativeTimeBaseUs + 999'999'999'999'999);
}

TEST(CaptureTime, OfAStampIsToldByItsDigits) {
  EXPECT_EQ(time_from_stamp("1403715273262142976"), 1'403'715'273'262'142);
  EXPECT_EQ(time_from_stamp("1403715273262142"), 1'403'715'273'262'142);
  EXPECT_EQ(time_from_stamp("1403715273262"), 1'403'715'273'262'000);
  for (const char* none : {"", "000001", "140371527326214297a", "-140371527326", "9999999999999999999"})
    EXPECT_FALSE(time_from_stamp(none)) << none;
}

TEST(CaptureTime, IsNothingWhereThereIsNone) {
  for (const char* none : {"", "soon", "nan", "inf", "-1", "5e9", "1 2", "1s"}) {
    EXPECT_FALSE(time_from_seconds(none)) << none;
    EXPECT_FALSE(time_from_nanoseconds(none)) << none;
  }
  EXPECT_FALSE(time_from_nanoseconds("9223372036854775807"));
  EXPECT_FALSE(time_from_nanoseconds("99999999999999999999"));
}

}  // namespace
}  // namespace relmap::capture
