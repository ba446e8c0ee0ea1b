#include "storage/memory/budget.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace relmap::storage {
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

TEST(Budget, CacheAndRoutesMakeRoomForTheAllocatorsHolesAndNothingElseDoes) {
  Budget budget(1600);
  budget.set(Share::kAllocator, 200);
  EXPECT_EQ(budget.used(), 200u);
  EXPECT_EQ(budget.allowance(Share::kCache), 1400u);
  EXPECT_EQ(budget.allowance(Share::kRoutes), 1050u) << "three quarters of that";
  budget.charge(Share::kDirty, 1500);
  EXPECT_TRUE(budget.try_charge(Share::kQueues, 100));
  EXPECT_FALSE(budget.try_charge(Share::kReplies, 1)) << "the others fill the limit";
  EXPECT_EQ(budget.allowance(Share::kCache), 0u);
}

TEST(Budget, RoutesTakeThreeQuartersOfWhatAllButTheCacheLeave) {
  Budget budget(1600);
  budget.charge(Share::kDirty, 600);
  budget.charge(Share::kCache, 900);
  EXPECT_EQ(budget.allowance(Share::kRoutes), 750u);
  EXPECT_TRUE(budget.try_charge(Share::kRoutes, 750));
  EXPECT_FALSE(budget.try_charge(Share::kRoutes, 1));
  EXPECT_EQ(budget.used(Share::kRoutes), 750u);
  EXPECT_EQ(budget.used_beside_cache(), 1350u);
  // Others get what they need even while routes still hold it.
  EXPECT_TRUE(budget.try_charge(Share::kQueues, 100));
  budget.set(Share::kEngine, 400);
  EXPECT_EQ(budget.allowance(Share::kRoutes), 375u);
}

TEST(Budget, CountsRightlyWhileManyCount) {
  Budget budget(1'000'000);
  std::vector<std::thread> threads;
  for (const Share share : {Share::kCache, Share::kRoutes, Share::kReplies})
    threads.emplace_back([&budget, share] {
      for (int i = 0; i < 20'000; ++i) {
        EXPECT_TRUE(budget.try_charge(share, 1000));
        EXPECT_GT(budget.allowance(Share::kRoutes), 400'000u);
        budget.release(share, 1000);
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(budget.used(), 0u);
}

TEST(Budget, PicturesHaveAReserveOfTheirOwn) {
  Budget budget(1600);
  EXPECT_TRUE(budget.try_charge(Share::kPictures, kPictureReserve));
  EXPECT_FALSE(budget.try_charge(Share::kPictures, 1));
  EXPECT_EQ(budget.used(), 0u);
}

}  // namespace
}  // namespace relmap::storage
