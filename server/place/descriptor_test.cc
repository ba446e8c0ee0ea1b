#include "server/place/descriptor.h"

#include <gtest/gtest.h>

#include <random>

namespace relmap::place {
namespace {

TEST(Descriptor, TheSquaredDistanceIsTheSumOfSquaredDifferences) {
  std::mt19937 random(1);
  Descriptor a, b;
  for (int pair = 0; pair < 200; ++pair) {
    std::uint32_t expected = 0;
    for (std::size_t i = 0; i < kDescriptorBytes; ++i) {
      a[i] = pair == 0 ? 255 : static_cast<std::uint8_t>(random() % 256);
      b[i] = pair == 0 ? 0 : static_cast<std::uint8_t>(random() % 256);
      expected += static_cast<std::uint32_t>((a[i] - b[i]) * (a[i] - b[i]));
    }
    EXPECT_EQ(squared_distance(a, b), expected);
    EXPECT_EQ(squared_distance(b, a), expected);
    EXPECT_EQ(squared_distance(a, a), 0u);
  }
}

}  // namespace
}  // namespace relmap::place
