#include "proto/base/hex.h"

#include <gtest/gtest.h>

#include <array>

namespace relmap {
namespace {

TEST(Hex, WritesBytesInTheirOrderAndNumbersWithTheirLeadingZeros) {
  EXPECT_EQ(hex(std::array<std::uint8_t, 4>{0x00, 0x1f, 0xa0, 0xff}), "001fa0ff");
  EXPECT_EQ(hex(ByteSpan()), "");
  EXPECT_EQ(hex(std::uint32_t{0x0badf00d}), "0badf00d");
  EXPECT_EQ(hex(std::uint32_t{0}), "00000000");
  EXPECT_EQ(hex(std::uint64_t{0x123456789abcdef0}), "123456789abcdef0");
  EXPECT_EQ(hex(std::uint64_t{1}), "0000000000000001");
}

TEST(Hex, ReadsDigitsOfEitherCase) {
  for (int value = 0; value < 16; ++value) {
    EXPECT_EQ(hex_digit("0123456789abcdef"[value]), value);
    EXPECT_EQ(hex_digit("0123456789ABCDEF"[value]), value);
  }
  for (const char c : {'g', 'G', ' ', '/', ':', '@', '`', '\0', '\xff'}) EXPECT_EQ(hex_digit(c), -1);
}

}  // namespace
}  // namespace relmap
