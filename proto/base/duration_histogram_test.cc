#include "proto/base/duration_histogram.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "proto/base/busy_since.h"

namespace relmap {
namespace {

TEST(DurationHistogram, CountsEachDurationInTheFirstBucketThatHoldsIt) {
  DurationHistogram histogram;
  histogram.add(0.0);
  histogram.add(0.0001);   // a bound is inclusive
  histogram.add(0.00011);  // the next bucket
  histogram.add(60.0);
  histogram.add(61.0);
  const DurationCounts counts = histogram.counts();
  EXPECT_EQ(counts.buckets[0], 2u);
  EXPECT_EQ(counts.buckets[1], 1u);
  EXPECT_EQ(counts.buckets[kDurationBounds.size() - 1], 1u);
  EXPECT_EQ(counts.buckets[kDurationBounds.size()], 1u);
  EXPECT_EQ(counts.total(), 5u);
  EXPECT_NEAR(counts.sum_s, 121.00021, 1e-9);
}

TEST(DurationHistogram, BoundsAscend) { EXPECT_TRUE(std::is_sorted(kDurationBounds.begin(), kDurationBounds.end())); }

TEST(DurationHistogram, LosesNothingThatSeveralThreadsAdd) {
  DurationHistogram histogram;
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&] {
      for (int n = 0; n < 1000; ++n) histogram.add(std::chrono::milliseconds(1));
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(histogram.counts().total(), 4000u);
  EXPECT_NEAR(histogram.counts().sum_s, 4.0, 1e-6);
}

TEST(BusySince, TellsHowLongThePresentPieceOfWorkHasTaken) {
  BusySince busy;
  EXPECT_EQ(busy.seconds(), 0) << "nothing has begun";
  {
    const BusySince::Work work(busy);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    EXPECT_GE(busy.seconds(), 0.002);
  }
  EXPECT_EQ(busy.seconds(), 0);
}

}  // namespace
}  // namespace relmap
