#include "proto/base/big_endian.h"

#include <gtest/gtest.h>

namespace relmap {
namespace {

TEST(BigEndian, TheMostSignificantByteComesFirst) {
  const Bytes bytes{0x89, 0x50, 0x4e, 0x47};
  EXPECT_EQ(big_endian(bytes), 0x89504e47u);
  EXPECT_EQ(big_endian(ByteSpan(bytes).first(2)), 0x8950u);
  EXPECT_EQ(big_endian(ByteSpan(bytes).first(1)), 0x89u);
}

}  // namespace
}  // namespace relmap
