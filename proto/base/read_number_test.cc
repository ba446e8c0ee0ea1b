#include "proto/base/read_number.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace relmap {
namespace {

TEST(ReadNumber, ReadsAWholeTextOfDigits) {
  std::uint64_t number = 1;
  EXPECT_TRUE(read_number("0", number));
  EXPECT_EQ(number, 0u);
  EXPECT_TRUE(read_number("18446744073709551615", number));
  EXPECT_EQ(number, ~std::uint64_t{0});
  std::uint16_t small = 0;
  EXPECT_TRUE(read_number("65535", small));
  EXPECT_EQ(small, 65535u);
}

TEST(ReadNumber, RefusesAllElseAndLeavesTheNumberAsItWas) {
  for (const char* text : {"", "-1", "+1", " 1", "1 ", "1,", "0x1", "1e3", "one", "4294967296"}) {
    std::uint32_t number = 7;
    EXPECT_FALSE(read_number(text, number)) << text;
    EXPECT_EQ(number, 7u) << text;
  }
  std::uint16_t small = 7;
  EXPECT_FALSE(read_number("65536", small));
  EXPECT_FALSE(read_number(std::string_view("12\0", 3), small)) << "a zero byte is no digit";
  EXPECT_EQ(small, 7u);
}

}  // namespace
}  // namespace relmap
