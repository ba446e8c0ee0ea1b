#include "proto/base/bar_text.h"

#include <gtest/gtest.h>

namespace relmap {
namespace {

TEST(BarText, IsFilledFromTheLeftAndKeepsItsWidth) {
  EXPECT_EQ(filled_bar_text(0, 4), "[....]");
  EXPECT_EQ(filled_bar_text(3, 4), "[###.]");
  EXPECT_EQ(filled_bar_text(9, 4), "[####]");
}

TEST(BarText, OfWorkIsFullOnlyWhenAllIsDone) {
  EXPECT_EQ(progress_bar_text(0, 100, 4), "[....]");
  EXPECT_EQ(progress_bar_text(50, 100, 4), "[##..]");
  EXPECT_EQ(progress_bar_text(99, 100, 4), "[###.]");
  EXPECT_EQ(progress_bar_text(100, 100, 4), "[####]");
  EXPECT_EQ(progress_bar_text(101, 100, 4), "[####]");
  EXPECT_EQ(progress_bar_text(7, 0, 4), "[....]") << "the total is not known";
}

}  // namespace
}  // namespace relmap
