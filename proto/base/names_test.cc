#include "proto/base/names.h"

#include <gtest/gtest.h>

#include <string>

namespace relmap {
namespace {

TEST(Names, TakeAnyWritingUpToSixtyFourBytes) {
  for (const std::string& name : {std::string("r2"), std::string("Zürich"), std::string("東京"), std::string("🤖"),
                                  std::string(64, 'a'), std::string("the dock"), std::string(" dock")})
    EXPECT_TRUE(check_name("robot", name).ok()) << name;
}

TEST(Names, RefuseEmptyLongMalformedAndUnprintable) {
  const std::string bad[] = {"",
                             std::string(65, 'a'),
                             " ",
                             "\xc2\xa0\xe3\x80\x80",  // white space of other writings
                             "a\nb",
                             std::string("a\0b", 3),
                             "\x7f",
                             "\xc2\x80",          // a C1 control
                             "\x80",              // continuation first
                             "\xc3",              // cut short
                             "\xc0\xaf",          // overlong
                             "\xe0\x80\x80",      // overlong
                             "\xed\xa0\x80",      // a surrogate
                             "\xf4\x90\x80\x80",  // beyond U+10FFFF
                             "\xff"};
  for (const std::string& name : bad) {
    const Status status = check_name("robot", name);
    EXPECT_EQ(status.reason(), Reason::BAD_NAME) << name;
    EXPECT_TRUE(status.message().starts_with("robot"));
  }
}

}  // namespace
}  // namespace relmap
