#include "proto/linear/huber.h"

#include <gtest/gtest.h>

#include <limits>

namespace relmap {
namespace {

TEST(Huber, LossAndWeightAgree) {
  for (const double e : {0.5, 1.9, 2.1, 7.0}) {
    const double step = 1e-6;
    const double slope = (huber_loss(e + step, 2) - huber_loss(e - step, 2)) / (2 * step);
    EXPECT_NEAR(huber_weight(e, 2), slope / (2 * e), 1e-6);
  }
}

TEST(Huber, WithoutACornerIsLeastSquares) {
  const double none = std::numeric_limits<double>::infinity();
  for (const double e : {0.0, 1.5, 1e6}) {
    EXPECT_EQ(huber_loss(e, none), e * e);
    EXPECT_EQ(huber_weight(e, none), 1);
  }
}

}  // namespace
}  // namespace relmap
