#include "storage/journal/range_crc.h"

#include <gtest/gtest.h>

#include <random>

#include "proto/base/crc32c.h"

namespace relmap::storage {
namespace {

TEST(RangeCrc, IsThatOfTheRange) {
  std::mt19937 random(1);
  for (const std::size_t size : {0U, 1U, 63U, 64U, 65U, 128U, 1000U, 70000U}) {
    Bytes bytes(size);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    const RangeCrc ranges(bytes);
    for (int i = 0; i < 500; ++i) {
      const std::size_t from = random() % (size + 1), count = random() % (size - from + 1);
      const std::uint32_t before = i % 2 == 0 ? 0 : static_cast<std::uint32_t>(random());
      ASSERT_EQ(ranges.of(from, count, before), crc32c(ByteSpan(bytes).subspan(from, count), before))
          << from << " + " << count << " of " << size;
    }
    EXPECT_EQ(ranges.of(0, size), crc32c(bytes));
  }
}

}  // namespace
}  // namespace relmap::storage
