#include "storage/memory/spares.h"

#include <gtest/gtest.h>

namespace relmap::storage {
namespace {

TEST(Spares, AreTakenOnlyWhenNobodyReadsThem) {
  Spares<int> spares(4);
  EXPECT_EQ(spares.take({1, 7}), nullptr);
  auto object = std::make_shared<int>(1);
  std::shared_ptr<const int> reader = object;
  const int* at = object.get();
  spares.put(std::move(object), 100, {1, 7});
  EXPECT_EQ(spares.bytes(), 100U);
  EXPECT_EQ(spares.take({1, 7}), nullptr);
  int free = 0;
  spares.for_each_free([&](int&) { ++free; });
  EXPECT_EQ(free, 0);
  reader.reset();
  spares.for_each_free([&](int&) { ++free; });
  EXPECT_EQ(free, 1);
  EXPECT_EQ(spares.take({1, 7}).get(), at);
  EXPECT_EQ(spares.bytes(), 0U);
  EXPECT_EQ(spares.take({1, 7}), nullptr);
}

TEST(Spares, AreReusedForTheSameFrameAndForAnotherOnlyWhenFull) {
  Spares<int> spares(3);
  for (std::uint32_t frame : {1U, 2U}) spares.put(std::make_shared<int>(frame), 1, {1, frame});
  EXPECT_EQ(spares.take({1, 9}), nullptr);
  spares.put(std::make_shared<int>(3), 1, {1, 3});
  EXPECT_EQ(*spares.take({1, 2}), 2);
  spares.put(std::make_shared<int>(4), 1, {1, 4});
  EXPECT_EQ(*spares.take({1, 9}), 1);  // the oldest of three
  EXPECT_EQ(spares.take({1, 9}), nullptr);
}

TEST(Spares, TheOldestGivesWay) {
  Spares<int> spares(2);
  std::weak_ptr<int> first;
  for (std::uint32_t frame : {1U, 2U, 3U}) {
    auto object = std::make_shared<int>(frame);
    if (frame == 1) first = object;
    spares.put(std::move(object), 10, {1, frame});
  }
  EXPECT_TRUE(first.expired());
  EXPECT_EQ(spares.bytes(), 20U);
}

}  // namespace
}  // namespace relmap::storage
