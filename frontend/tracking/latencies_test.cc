#include "frontend/tracking/latencies.h"

#include <gtest/gtest.h>

namespace relmap::tracking {
namespace {

TEST(Latencies, QuantilesAreWithinAPercent) {
  Latencies latencies;
  EXPECT_EQ(latencies.quantile(0.5), 0);
  for (int i = 1; i <= 1000; ++i) latencies.add(i);
  EXPECT_EQ(latencies.count(), 1000u);
  EXPECT_NEAR(latencies.quantile(0.5), 500, 5.5);
  EXPECT_NEAR(latencies.quantile(0.99), 990, 10.5);
  EXPECT_NEAR(latencies.quantile(0), 1, 0.011);
  EXPECT_NEAR(latencies.quantile(1), 1000, 10.5);
}

TEST(Latencies, ValuesOutOfRangeCountAsTheEnds) {
  Latencies latencies;
  latencies.add(0);
  latencies.add(1e9);
  EXPECT_LT(latencies.quantile(0), 0.0102);
  EXPECT_GT(latencies.quantile(1), 9.9e4);
}

}  // namespace
}  // namespace relmap::tracking
