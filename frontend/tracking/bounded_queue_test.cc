#include "frontend/tracking/bounded_queue.h"

#include <gtest/gtest.h>

#include <optional>
#include <thread>

namespace relmap::tracking {
namespace {

TEST(BoundedQueue, GivesEverythingInOrder) {
  constexpr int kItems = 10'000;
  BoundedQueue<int> queue(3);
  std::jthread giver([&] {
    for (int i = 0; i < kItems; ++i) EXPECT_TRUE(queue.push(i));
    queue.close();
  });
  int next = 0;
  while (const auto item = queue.pop()) EXPECT_EQ(*item, next++);
  EXPECT_EQ(next, kItems);
}

TEST(BoundedQueue, DropsTheOldestItemToMakeRoom) {
  BoundedQueue<int> queue(2);
  for (const int item : {1, 2, 3}) {
    const auto pushed = queue.push_dropping_oldest(item);
    EXPECT_TRUE(pushed.taken);
    EXPECT_EQ(pushed.dropped, item == 3);
  }
  queue.close();
  EXPECT_EQ(queue.pop(), 2);
  EXPECT_EQ(queue.pop(), 3);
  EXPECT_EQ(queue.pop(), std::nullopt);
}

TEST(BoundedQueue, CancellingEndsTheWaitsOfBothSides) {
  BoundedQueue<int> full(1), empty(1);
  EXPECT_TRUE(full.push(1));
  std::jthread giver([&] { EXPECT_FALSE(full.push(2)); });
  std::jthread taker([&] { EXPECT_EQ(empty.pop(), std::nullopt); });
  full.cancel();
  empty.cancel();
  giver.join();
  taker.join();
  EXPECT_EQ(full.pop(), std::nullopt);
  EXPECT_FALSE(full.push_dropping_oldest(3).taken);
}

}  // namespace
}  // namespace relmap::tracking
