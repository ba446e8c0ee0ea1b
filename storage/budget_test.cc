#include "storage/budget.h"

#include <gtest/gtest.h>

namespace relmap {
namespace {

TEST(Budget, CountsByShareAndInAll) {
  Budget budget(1600);
  budget.charge(Share::kDirty, 10);
  budget.set(Share::kEngine, 20);
  EXPECT_TRUE(budget.try_charge(Share::kQueues, 30));
  EXPECT_EQ(budget.used(), 60u);
  EXPECT_EQ(budget.used(Share::kQueues), 30u);
  budget.release(Share::kQueues, 30);
  budget.set(Share::kEngine, 5);
  EXPECT_EQ(budget.used(), 15u);
}

TEST(Budget, RefusesBeyondAShareAndChargesNothingThen) {
  Budget budget(1600);
  EXPECT_TRUE(budget.try_charge(Share::kQueues, 100));
  EXPECT_FALSE(budget.try_charge(Share::kQueues, 1));
  EXPECT_EQ(budget.used(Share::kQueues), 100u);
  EXPECT_TRUE(budget.try_charge(Share::kReplies, 100));
}

TEST(Budget, RefusesBeyondTheLimit) {
  Budget budget(1600);
  budget.set(Share::kPlaceIndex, 1590);
  EXPECT_TRUE(budget.try_charge(Share::kQueues, 10));
  EXPECT_FALSE(budget.try_charge(Share::kReplies, 1));
}

TEST(Budget, TheCacheTakesWhatIsLeftAndGivesWay) {
  Budget budget(1600);
  budget.charge(Share::kDirty, 600);
  EXPECT_EQ(budget.allowance(Share::kCache), 1000u);
  int evictions = 0;
  budget.add_evictor(&budget, [&] {
    ++evictions;
    const std::size_t over = budget.used(Share::kCache) - budget.allowance(Share::kCache);
    budget.release(Share::kCache, over);
  });
  budget.charge(Share::kCache, 1000);
  EXPECT_EQ(evictions, 0);
  EXPECT_TRUE(budget.try_charge(Share::kQueues, 50));
  EXPECT_EQ(evictions, 1);
  EXPECT_EQ(budget.used(), budget.limit());
  budget.set(Share::kPlaceIndex, 100);
  EXPECT_EQ(evictions, 2);
  EXPECT_EQ(budget.used(Share::kCache), 850u);
  budget.remove_evictor(&budget);
}

TEST(Budget, PicturesHaveAReserveOfTheirOwn) {
  Budget budget(1600);
  EXPECT_TRUE(budget.try_charge(Share::kPictures, kPictureReserve));
  EXPECT_FALSE(budget.try_charge(Share::kPictures, 1));
  EXPECT_EQ(budget.used(), 0u);
}

}  // namespace
}  // namespace relmap
