#include "server/monitor/clock_watch.h"

#include <gtest/gtest.h>

namespace relmap::monitor {
namespace {

TEST(ClockWatch, NoticesStepsAndNoSlewing) {
  ClockWatch::Times now{1000, 50};
  ClockWatch watch([&] { return now; });
  const auto pass = [&](double seconds, double step) {
    now.steady_s += seconds;
    now.day_s += seconds + step;
    return watch.look();
  };
  EXPECT_FALSE(pass(0.5, 0));
  EXPECT_FALSE(pass(3600, 0)) << "the thread that looks was late, or the machine slept";
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(pass(0.5, 0.0003)) << "a clock is slewed by 500 ppm";
  EXPECT_EQ(watch.steps(), 0u);
  EXPECT_TRUE(pass(0.5, 30));
  EXPECT_NEAR(watch.last_step_s(), 30, 1e-6);
  EXPECT_FALSE(pass(0.5, 0)) << "a step is told once";
  EXPECT_TRUE(pass(0.5, -3600));
  EXPECT_NEAR(watch.last_step_s(), -3600, 1e-6);
  EXPECT_EQ(watch.steps(), 2u);
  EXPECT_EQ(watch.last_step_age_s(), 0);
  pass(120, 0);
  EXPECT_NEAR(watch.last_step_age_s(), 120, 1e-6);
}

TEST(ClockWatch, ReadsTheSystemsClocks) {
  ClockWatch watch;
  EXPECT_FALSE(watch.look());
}

}  // namespace
}  // namespace relmap::monitor
