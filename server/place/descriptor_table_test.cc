#include "server/place/descriptor_table.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace relmap::place {
namespace {

TEST(DescriptorTable, DistancesDifferFromThoseOfPairsByTheSquaredLength) {
  RecordProperty("kernels", static_cast<int>(DescriptorTable::kernels().size()));  // those of this processor
  std::mt19937 random(1);
  for (const std::size_t size : {0u, 1u, 15u, 16u, 17u, 100u}) {
    std::vector<Descriptor> descriptors(size);
    for (Descriptor& descriptor : descriptors)
      for (auto& byte : descriptor) byte = static_cast<std::uint8_t>(random() % 256);
    if (size > 0) descriptors.back().fill(255);
    for (const DescriptorTable::Kernel kernel : DescriptorTable::kernels()) {
      const DescriptorTable table(descriptors, kernel);
      ASSERT_EQ(table.size(), size);
      Descriptor d, zero;
      d.fill(255);
      zero.fill(0);
      for (int query = 0; query < 4; ++query) {
        std::vector<std::int32_t> distances(size);
        table.compare(d, distances);
        for (std::size_t i = 0; i < size; ++i)
          EXPECT_EQ(distances[i] + static_cast<std::int64_t>(squared_distance(d, zero)),
                    static_cast<std::int64_t>(squared_distance(d, descriptors[i])))
              << "kernel " << static_cast<int>(kernel);
        if (query == 0) d.fill(0);
        if (query > 0)
          for (auto& byte : d) byte = static_cast<std::uint8_t>(random() % 256);
      }
    }
  }
}

}  // namespace
}  // namespace relmap::place
