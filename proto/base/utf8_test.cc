#include "proto/base/utf8.h"

#include <gtest/gtest.h>

#include <string>

namespace relmap {
namespace {

TEST(Utf8, IsTakenCodePointByCodePoint) {
  std::string_view text = "a\xc3\xbc\xe6\x9d\xb1\xf0\x9f\xa4\x96";
  EXPECT_TRUE(is_utf8(text));
  for (const char32_t code : {U'a', U'ü', U'東', U'🤖'}) EXPECT_EQ(take_code_point(text), code);
  EXPECT_TRUE(text.empty());
  EXPECT_TRUE(is_utf8(""));
}

TEST(Utf8, MalformedBytesAreRefusedAnywhereInAText) {
  for (const std::string bad :
       {"\x80", "\xc3", "\xc0\xaf", "\xe0\x80\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xff"}) {
    EXPECT_FALSE(is_utf8(bad));
    EXPECT_FALSE(is_utf8("before " + bad));
    EXPECT_FALSE(is_utf8(bad + " behind"));
    std::string_view text = bad;
    EXPECT_FALSE(take_code_point(text).has_value());
    EXPECT_EQ(text, bad) << "stays as it is";
  }
}

TEST(Utf8, WhiteSpaceIsWhatUnicodeCallsSo) {
  int count = 0;
  for (char32_t code = 0; code <= 0x10ffff; ++code) count += is_white_space(code) ? 1 : 0;
  EXPECT_EQ(count, 25) << "PropList.txt of Unicode 15";
  for (const char32_t code : {U' ', U'\t', U'\n', U'\u00a0', U'\u2003', U'\u3000'}) EXPECT_TRUE(is_white_space(code));
  for (const char32_t code : {U'a', U'_', U'\u200b', U'\ufeff', U'東'}) EXPECT_FALSE(is_white_space(code));
}

}  // namespace
}  // namespace relmap
