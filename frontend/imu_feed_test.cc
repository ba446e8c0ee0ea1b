#include "frontend/imu_feed.h"

#include <gtest/gtest.h>

#include <cmath>

#include "frontend/tracking/gyro.h"
#include "frontend/tracking/stamps.h"

namespace relmap::frontend {
namespace {

constexpr std::int64_t kBegin = 1'600'000'000'000'000, kSample = 5'000, kPair = 100'000;

// The angle about z and its rate, `s` seconds after the beginning; each step has a different rotation.
double angle(double s) { return 0.2 * s * s; }
Vector3 rate(double s) { return {0, 0, 0.4 * s}; }

ImuRecording recording(double seconds) {
  ImuRecording made;
  for (std::int64_t us = 0; us <= std::llround(1e6 * seconds); us += kSample)
    made.samples.push_back({kBegin + us, rate(1e-6 * static_cast<double>(us)), Vector3::Zero()});
  return made;
}

TEST(ImuFeed, GivesSamplesUpToTheFirstThatIsNotEarlier) {
  ImuFeed feed(recording(1));
  EXPECT_EQ(feed.until(kBegin + 2 * kSample).size(), 3u);
  EXPECT_EQ(feed.until(kBegin + 3 * kSample + 1).back().time_us, kBegin + 4 * kSample);
  EXPECT_EQ(feed.until(kBegin + kPair).back().time_us, kBegin + kPair);
  EXPECT_EQ(feed.until(kBegin + 3'000'000).back().time_us, kBegin + 1'000'000);
  EXPECT_EQ(feed.until(kBegin + 4'000'000).size(), 0u);
}

// The camera's clock is set back by five seconds, the gyro's is not. Rotations must still be those between the pairs.
TEST(ImuFeed, FollowsThePairsWhenTheirClockIsSetBack) {
  const ImuRecording recorded = recording(4);
  ImuFeed feed(recorded);
  tracking::Gyro gyro(recorded.calibration);
  tracking::StampFilter stamps;
  std::optional<std::int64_t> last_us;
  int last = 0, turns = 0;
  for (int pair = 1; pair < 39; ++pair) {
    const auto time_us = stamps.admit(kBegin + pair * kPair - (pair < 15 ? 0 : 5'000'000));
    if (!time_us.ok()) continue;
    const auto samples = feed.until(*time_us);
    EXPECT_LT(samples.back().time_us, kBegin + pair * kPair + kSample);
    gyro.add(samples);
    if (last_us) {
      const auto turn = gyro.turn(*last_us, *time_us);
      ASSERT_TRUE(turn.has_value()) << pair;
      EXPECT_NEAR(rotation_angle(turn->R_from_to), angle(0.1 * pair) - angle(0.1 * last), 1e-6) << pair;
      ++turns;
    }
    last_us = *time_us;
    last = pair;
    gyro.forget_before(*time_us);
  }
  EXPECT_GE(turns, 30);
}

}  // namespace
}  // namespace relmap::frontend
