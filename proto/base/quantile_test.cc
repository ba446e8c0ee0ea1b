#include "proto/base/quantile.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace relmap {
namespace {

TEST(Quantile, IsASampleAndTheLowerOneBetweenTwo) {
  const std::vector<double> samples{4, 1, 3, 2};
  EXPECT_EQ(quantile(samples, 0), 1);
  EXPECT_EQ(quantile(samples, 0.5), 2);
  EXPECT_EQ(quantile(samples, 1), 4);
  EXPECT_EQ(quantile({}, 0.5), 0);
}

TEST(WeightedQuantile, CountsASampleAsOftenAsItIsThere) {
  const std::vector<Weighted> samples{{1, 1}, {2, 2}, {3, 0}, {4, 7}};
  const std::vector<double> expanded{1, 2, 2, 4, 4, 4, 4, 4, 4, 4};
  for (const double share : {0.0, 0.1, 0.12, 0.3, 0.5, 0.9, 1.0})
    EXPECT_EQ(weighted_quantile(samples, share), quantile(expanded, share)) << share;
  EXPECT_EQ(weighted_quantile(samples, 0.5), 4);
  EXPECT_EQ(weighted_quantile({}, 0.5), 0);
}

TEST(UpperMedian, IsTheUpperOfTwoMiddleSamples) {
  EXPECT_EQ(upper_median(std::vector<std::int64_t>{4, 1, 3, 2}), 3);
  EXPECT_EQ(upper_median(std::vector<float>{5, 1, 4}), 4);
  EXPECT_EQ(upper_median(std::vector<double>{7}), 7);
}

TEST(Ranked, CountsFromTheSmallest) {
  const std::vector<float> samples{4, 1, 3, 2};
  EXPECT_EQ(ranked(samples, 0), 1);
  EXPECT_EQ(ranked(samples, 3), 4);
}

}  // namespace
}  // namespace relmap
