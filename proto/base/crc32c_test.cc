#include "proto/base/crc32c.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>
#include <vector>

namespace relmap {
namespace {

struct Vector {
  std::vector<std::uint8_t> bytes;
  std::uint32_t crc;
};

// RFC 3720, B.4, and the check value of the catalogue of CRCs.
std::vector<Vector> rfc3720() {
  std::vector<std::uint8_t> ascending(32), descending(32);
  std::iota(ascending.begin(), ascending.end(), std::uint8_t{0});
  std::iota(descending.rbegin(), descending.rend(), std::uint8_t{0});
  const std::vector<std::uint8_t> iscsi_read = {0x01, 0xc0, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
                                                0x00, 0x00, 0x00, 0x00, 0x14, 0x00, 0x00, 0x00, 0x00, 0x00, 0x04, 0x00,
                                                0x00, 0x00, 0x00, 0x14, 0x00, 0x00, 0x00, 0x18, 0x28, 0x00, 0x00, 0x00,
                                                0x00, 0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00};
  return {{std::vector<std::uint8_t>(32, 0x00), 0x8a9136aa},
          {std::vector<std::uint8_t>(32, 0xff), 0x62a8ab43},
          {ascending, 0x46dd794e},
          {descending, 0x113fdb5c},
          {iscsi_read, 0xd9963a56},
          {{'1', '2', '3', '4', '5', '6', '7', '8', '9'}, 0xe3069283},
          {{}, 0}};
}

TEST(Crc32c, GivesTheVectorsOfRfc3720) {
  for (const Vector& v : rfc3720()) {
    EXPECT_EQ(crc32c(v.bytes), v.crc);
    EXPECT_EQ(detail::crc32c_by_table(v.bytes), v.crc);
  }
}

TEST(Crc32c, InstructionAndTableAgreeAtEveryLengthAndContinueEachOther) {
  std::mt19937 random(1);
  std::vector<std::uint8_t> bytes(100);
  for (auto& b : bytes) b = static_cast<std::uint8_t>(random());
  const std::span all(bytes);
  for (std::size_t size = 0; size <= bytes.size(); ++size) {
    EXPECT_EQ(crc32c(all.first(size)), detail::crc32c_by_table(all.first(size)));
    EXPECT_EQ(crc32c(all.subspan(size), crc32c(all.first(size))), crc32c(all));
    EXPECT_EQ(detail::crc32c_by_table(all.subspan(size), crc32c(all.first(size))), crc32c(all));
  }
}

}  // namespace
}  // namespace relmap
