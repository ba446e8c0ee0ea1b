#include "proto/base/printf_text.h"

#include <gtest/gtest.h>

#include <string>

namespace relmap {
namespace {

TEST(PrintfText, IsWholeWhateverItsLength) {
  EXPECT_EQ(printf_text("%.2f%%", 12.345), "12.35%");
  EXPECT_EQ(printf_text("%s", ""), "");
  const std::string text(5000, 'x');
  EXPECT_EQ(printf_text("<%s>", text.c_str()), "<" + text + ">");
}

}  // namespace
}  // namespace relmap
