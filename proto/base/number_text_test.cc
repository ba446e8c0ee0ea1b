#include "proto/base/number_text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace relmap {
namespace {

TEST(NumberText, HasAsManyDigitsAsSomebodyReads) {
  EXPECT_EQ(number_text(0), "0");
  EXPECT_EQ(number_text(0.5), "0.5");
  EXPECT_EQ(number_text(-0.012345), "-0.0123");
  EXPECT_EQ(number_text(std::sqrt(1e9)), "31623");
  EXPECT_EQ(number_text(31.622776602), "31.6");
  EXPECT_EQ(number_text(999.4), "999");
  EXPECT_EQ(number_text(999.6), "1000");
  EXPECT_EQ(number_text(1 << 20), "1048576");
  EXPECT_EQ(number_text(3e-7), "3e-07");
  EXPECT_EQ(number_text(std::numeric_limits<double>::quiet_NaN()), "nan");
  EXPECT_EQ(number_text(-std::numeric_limits<double>::infinity()), "-inf");
}

TEST(NumberText, ZeroHasNoSign) {
  EXPECT_EQ(number_text(-0.0), "0");
  EXPECT_EQ(fixed(-0.0, 2), "0.00");
  EXPECT_EQ(fixed(-0.0004, 3), "0.000");
  EXPECT_EQ(fixed(-0.0006, 3), "-0.001");
  EXPECT_EQ(fixed(0.0006, 3), "0.001");
  EXPECT_EQ(fixed(-12, 0), "-12");
  EXPECT_EQ(fixed(-0.4, 0), "0");
  EXPECT_EQ(fixed(-std::numeric_limits<double>::infinity(), 1), "-inf");
}

TEST(CountText, SeparatesThousandsAndKnowsOneFromMany) {
  EXPECT_EQ(count_text(0), "0");
  EXPECT_EQ(count_text(999), "999");
  EXPECT_EQ(count_text(1234), "1,234");
  EXPECT_EQ(count_text(1234567), "1,234,567");
  EXPECT_EQ(counted_text(1, "session"), "1 session");
  EXPECT_EQ(counted_text(0, "session"), "0 sessions");
  EXPECT_EQ(counted_text(12816, "keyframe"), "12,816 keyframes");
}

}  // namespace
}  // namespace relmap
