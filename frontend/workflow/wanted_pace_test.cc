#include "frontend/workflow/wanted_pace.h"

#include <gtest/gtest.h>

namespace relmap::workflow {
namespace {

using std::chrono::seconds;

PoseNews slow_down(double hz) {
  PoseNews news;
  news.kind = PoseNews::Kind::kSlowDown;
  news.rate_hz = hz;
  return news;
}

PoseNews resume() {
  PoseNews news;
  news.kind = PoseNews::Kind::kResume;
  return news;
}

TEST(WantedPace, IsReportedOnceHoweverOftenItIsRepeated) {
  const WantedPace::Time now{};
  WantedPace pace(seconds(15));
  EXPECT_EQ(pace.hz(), 0);
  EXPECT_EQ(pace.hear(slow_down(2.5), now), "the daemon asks for at most 2.5 keyframes/s");
  EXPECT_FALSE(pace.hear(slow_down(2), now));
  EXPECT_EQ(pace.hz(), 2);
  EXPECT_EQ(pace.hear(resume(), now), "the daemon takes keyframes at any rate again");
  EXPECT_FALSE(pace.hear(resume(), now));
  EXPECT_EQ(pace.hz(), 0);
  EXPECT_TRUE(pace.hear(slow_down(4), now));
  EXPECT_EQ(pace.slow_downs(), 2u);
}

TEST(WantedPace, ExpiresIfItIsNotRepeated) {
  const WantedPace::Time begin{};
  WantedPace pace(seconds(15));
  pace.hear(slow_down(2), begin);
  pace.hear(slow_down(2), begin + seconds(10));
  pace.look(begin + seconds(25));
  EXPECT_EQ(pace.hz(), 2);
  pace.look(begin + seconds(26));
  EXPECT_EQ(pace.hz(), 0) << "that it holds no more may be lost";
}

}  // namespace
}  // namespace relmap::workflow
