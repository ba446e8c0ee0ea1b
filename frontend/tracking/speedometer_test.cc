#include "frontend/tracking/speedometer.h"

#include <gtest/gtest.h>

#include <cmath>

namespace relmap::tracking {
namespace {

TEST(Speedometer, KeepsDrivingAndStandingApart) {
  Speedometer speedometer;
  std::int64_t time = 1'000'000'000;
  double z = 0;
  speedometer.add(time, {0, 0, 0});
  for (int i = 0; i < 50; ++i) speedometer.add(time += 100'000, {0, 0, z += 0.1});  // 1 m/s for 5 s
  EXPECT_NEAR(speedometer.speed(), 1, 1e-9);
  EXPECT_EQ(speedometer.driven_us(), 5'000'000);
  for (int i = 0; i < 50; ++i) speedometer.add(time += 100'000, {0, 0, z});
  EXPECT_EQ(speedometer.speed(), 0);
  EXPECT_NEAR(static_cast<double>(speedometer.standing_us()), 5e6, 0.6e6);
  EXPECT_EQ(speedometer.standing_us() + speedometer.driven_us(), 10'000'000);
  speedometer.restart();
  EXPECT_EQ(speedometer.standing_us() + speedometer.driven_us(), 0);
}

TEST(Speedometer, IsNotFooledByNoise) {
  Speedometer speedometer;
  std::int64_t time = 0;
  for (int i = 0; i < 300; ++i)
    speedometer.add(time += 33'333, {0.004 * std::sin(i * 2.1), 0, 0.004 * std::cos(i * 1.3)});
  EXPECT_GT(static_cast<double>(speedometer.standing_us()), 0.9 * 300 * 33'333);
}

TEST(Speedometer, HandlesALongGap) {
  Speedometer speedometer;
  speedometer.add(0, {0, 0, 0});
  speedometer.add(10'000'000, {0, 0, 5});
  EXPECT_NEAR(speedometer.speed(), 0.5, 1e-9);
  EXPECT_EQ(speedometer.driven_us(), 10'000'000);
}

}  // namespace
}  // namespace relmap::tracking
