#include "proto/number_text.h"

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

}  // namespace
}  // namespace relmap
