#include "frontend/tracking/stamps.h"

#include <gtest/gtest.h>

namespace relmap::tracking {
namespace {

constexpr std::int64_t kBase = 1'600'000'000'000'000, kStep = 100'000, kHour = 3'600'000'000;

TEST(StampFilter, LetsRisingStampsPassUnchanged) {
  StampFilter filter;
  for (int i = 0; i < 10; ++i) EXPECT_EQ(filter.admit(kBase + i * kStep).value(), kBase + i * kStep);
  EXPECT_EQ(filter.admit(kBase + 30'000'000).value(), kBase + 30'000'000);  // half a minute of nothing
}

TEST(StampFilter, RefusesOneStampThatJumpsAndGoesOn) {
  StampFilter filter(kBase);
  EXPECT_EQ(filter.admit(kBase).reason(), Reason::TIME_BACKWARDS);
  EXPECT_EQ(filter.admit(kBase - kStep).reason(), Reason::TIME_BACKWARDS);
  EXPECT_EQ(filter.admit(kBase + kHour).reason(), Reason::TIME_AHEAD);
  EXPECT_EQ(filter.admit(kBase + kStep).value(), kBase + kStep);
  EXPECT_EQ(filter.admit(kBase + kHour).reason(), Reason::TIME_AHEAD);
  EXPECT_EQ(filter.admit(kBase + 2 * kHour).reason(), Reason::TIME_AHEAD);  // they do not agree
  EXPECT_EQ(filter.admit(kBase + 2 * kStep).value(), kBase + 2 * kStep);
}

TEST(StampFilter, AcceptsAClockThatWasSetAhead) {
  StampFilter filter(kBase);
  EXPECT_EQ(filter.admit(kBase + kHour).reason(), Reason::TIME_AHEAD);
  EXPECT_EQ(filter.admit(kBase + kHour + kStep).value(), kBase + kHour + kStep);
  EXPECT_EQ(filter.admit(kBase + kHour + 2 * kStep).value(), kBase + kHour + 2 * kStep);
}

TEST(StampFilter, ContinuesWhenTheClockWasSetBack) {
  StampFilter filter;
  std::int64_t last = 0;
  for (int i = 0; i < 3; ++i) last = filter.admit(kBase + i * kStep).value();
  int refused = 0;
  std::int64_t stamp = kBase - kHour;
  Result<std::int64_t> admitted = filter.admit(stamp);
  for (; !admitted.ok() && refused < 20; ++refused) admitted = filter.admit(stamp += kStep);
  ASSERT_TRUE(admitted.ok());
  EXPECT_EQ(refused, 4);  // the fifth is believed
  // The pairs refused took their time.
  EXPECT_EQ(admitted.value(), last + (refused + 1) * kStep);
  EXPECT_EQ(filter.admit(stamp + kStep).value(), last + (refused + 2) * kStep);
}

}  // namespace
}  // namespace relmap::tracking
