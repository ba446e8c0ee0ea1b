#include "frontend/capture/dc1394/restart_pause.h"

#include <gtest/gtest.h>

namespace relmap::iidc::dc1394 {
namespace {

using std::chrono::milliseconds;

TEST(Iidc1394RestartPause, GrowsToTwoSecondsAndIsForgotten) {
  RestartPause pause;
  auto now = RestartPause::Clock::now();
  EXPECT_TRUE(pause.allows_start(now).ok());
  const Status how(Reason::CAMERA_GONE, "signal 11");
  for (const int ms : {100, 200, 400, 800, 1600, 2000, 2000}) {
    pause.crashed(how, now);
    EXPECT_EQ("CAMERA_GONE: signal 11", pause.allows_start(now + milliseconds(ms - 1)).to_string());
    EXPECT_TRUE(pause.allows_start(now + milliseconds(ms)).ok());
    now += milliseconds(ms);
  }
  now += RestartPause::kForgotten + milliseconds(1);
  pause.crashed(how, now);
  EXPECT_FALSE(pause.allows_start(now + milliseconds(99)).ok());
  EXPECT_TRUE(pause.allows_start(now + milliseconds(100)).ok());
}

}  // namespace
}  // namespace relmap::iidc::dc1394
