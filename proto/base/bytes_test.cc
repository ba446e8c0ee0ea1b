#include "proto/base/bytes.h"

#include <gtest/gtest.h>

namespace relmap {
namespace {

TEST(Bytes, AreLittleEndianWithoutPadding) {
  ByteWriter out;
  out.put(std::uint8_t{1});
  out.put(std::uint32_t{0x04030201});
  out.put_string("ab");
  EXPECT_EQ(out.bytes(), (Bytes{1, 1, 2, 3, 4, 2, 0, 'a', 'b'}));
}

TEST(Bytes, ReadBackWhatWasWritten) {
  ByteWriter out;
  out.put(3.25);
  const float values[] = {1, -2, 3};
  out.put_array(values, 3);
  out.put_string("");
  out.put_bytes(as_bytes("xyz"));
  out.patch(0, 4.5);
  ByteReader in(out.bytes());
  EXPECT_EQ(in.get<double>(), 4.5);
  float back[3];
  in.get_array(back, 3);
  EXPECT_EQ(back[1], -2);
  EXPECT_EQ(in.get_string(), "");
  EXPECT_EQ(in.get_bytes(3)[2], 'z');
  EXPECT_TRUE(in.at_end());
}

TEST(Bytes, AReadPastTheEndGivesZerosAndSpoilsTheReader) {
  const Bytes three = {1, 2, 3};
  ByteReader in(three);
  EXPECT_EQ(in.get<std::uint32_t>(), 0u);
  EXPECT_FALSE(in.ok());
  EXPECT_EQ(in.get<std::uint8_t>(), 0);
  EXPECT_FALSE(in.at_end());
  EXPECT_FALSE(in.fits(0, 1));
}

TEST(Bytes, FitsCannotOverflow) {
  const Bytes eight(8);
  const ByteReader in(eight);
  EXPECT_TRUE(in.fits(2, 4));
  EXPECT_FALSE(in.fits(3, 4));
  EXPECT_FALSE(in.fits(std::size_t{1} << 62, 8));
}

TEST(Bytes, AStringLongerThanWhatFollowsIsNone) {
  const Bytes bytes = {9, 0, 'a'};
  ByteReader in(bytes);
  EXPECT_EQ(in.get_string(), "");
  EXPECT_FALSE(in.ok());
}

}  // namespace
}  // namespace relmap
