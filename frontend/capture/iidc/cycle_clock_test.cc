#include "frontend/capture/iidc/cycle_clock.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace relmap::iidc {
namespace {

std::uint32_t shown(double camera_s) {
  camera_s = std::fmod(camera_s, 128);
  const auto seconds = static_cast<std::uint32_t>(camera_s);
  const double rest = camera_s - seconds;
  const auto cycles = static_cast<std::uint32_t>(rest / 125e-6);
  const auto ticks = std::min(3071u, static_cast<std::uint32_t>((rest - cycles * 125e-6) * 24.576e6));
  return seconds << 25 | cycles << 12 | ticks;
}

TEST(IidcCycleClock, ReadsSecondsCyclesAndTicks) {
  EXPECT_DOUBLE_EQ(cycle_seconds(5u << 25 | 4000u << 12), 5.5);
  EXPECT_NEAR(cycle_seconds(shown(127.123456)), 127.123456, 1e-7);
  EXPECT_TRUE(is_cycle_time(7999u << 12 | 3071u));
  EXPECT_FALSE(is_cycle_time(8000u << 12));
  EXPECT_FALSE(is_cycle_time(3072u));
}

// Ten minutes of a camera whose crystal is 80 ppm fast, read once a second; answers take 0.2 to 2 ms, lopsidedly.
TEST(IidcCycleClock, FollowsDriftThroughWraps) {
  std::mt19937 random(3);
  std::exponential_distribution<double> late(1 / 300.0);  // us
  CycleClock clock;
  const std::int64_t start = 9'000'000'000;
  const double ppm = 80, begun = 100.7;
  const auto camera_at = [&](double host_us) { return begun + 1e-6 * host_us * (1 + 1e-6 * ppm); };
  double worst = 0;
  for (int second = 0; second < 600; ++second) {
    const double before = 1e6 * second, read = before + 100 + late(random), after = read + 100 + late(random);
    EXPECT_TRUE(clock.observe(shown(camera_at(read)), start + std::llround(before), start + std::llround(after)));
    if (second == 5) {
      EXPECT_FALSE(clock.drift_ppm());
    }
    if (second < 30) continue;
    const double exposed = before - 40'000;  // a frame's stamp, a little old
    const std::int64_t told = clock.host_us(shown(camera_at(exposed)), start + std::llround(before));
    worst = std::max(worst, std::abs(static_cast<double>(told - start) - exposed));
  }
  ASSERT_TRUE(clock.drift_ppm());
  EXPECT_NEAR(*clock.drift_ppm(), ppm, 5);
  EXPECT_LT(worst, 300);  // us: below the spread of a single reading
  EXPECT_LT(clock.uncertainty_us(), 200);
}

TEST(IidcCycleClock, BeginsAnewWhenTheCameraWasReset) {
  CycleClock clock;
  EXPECT_TRUE(clock.observe(shown(50), 1'000'000, 1'000'200));
  EXPECT_TRUE(clock.observe(shown(51), 2'000'000, 2'000'200));
  EXPECT_FALSE(clock.observe(shown(0.5), 3'000'000, 3'000'200));
  EXPECT_NEAR(static_cast<double>(clock.host_us(shown(0.75), 3'300'000)), 3'250'100, 2);
}

}  // namespace
}  // namespace relmap::iidc
