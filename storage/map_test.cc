#include "storage/map.h"

#include <gtest/gtest.h>

#include "storage/memory_engine.h"
#include "storage/testing/random_frames.h"

namespace relmap {
namespace {

struct Fixture : ::testing::Test {
  std::shared_ptr<Engine> engine = make_memory_engine();
  std::uint64_t epoch = engine->acquire().value();
  std::shared_ptr<Budget> budget = std::make_shared<Budget>(std::size_t{64} << 20);
  RandomFrames random{7};

  std::unique_ptr<Map> open() { return Map::open(engine, epoch, budget).value(); }

  void begin(Map& map, SessionNumber number) {
    Session session;
    session.number = number;
    session.header.uuid.bytes[0] = static_cast<std::uint8_t>(number);
    map.add_session(session);
  }
  void add(Map& map, FrameId id) {
    map.add_frame(id, random.hot(id), random.warm(), random.cold());
    Session& session = map.edit_session(id.session);
    session.last = id.index;
    ++session.frames;
  }
};
using MapTest = Fixture;

TEST_F(MapTest, WhatIsCommittedIsThereAfterReopening) {
  auto map = open();
  begin(*map, 1);
  for (std::uint32_t i = 0; i < 200; ++i) {
    add(*map, {1, i});
    if (i % 37 == 0) {
      ASSERT_TRUE(map->commit().ok());
    }
  }
  map->state().applied_sequence = 200;
  map->state().pending = {{1, 3}, {1, 150}};
  ASSERT_TRUE(map->commit().ok());
  std::vector<float> errors;
  for (std::uint32_t i = 0; i < 200; ++i) {
    map->edit_hot({1, i}).mean_error = static_cast<float>(i);
    if (i % 50 == 0) {
      ASSERT_TRUE(map->commit().ok());
    }
  }
  ASSERT_TRUE(map->commit().ok());
  map.reset();

  map = open();
  EXPECT_EQ(map->state().applied_sequence, 200u);
  EXPECT_EQ(map->state().pending, (std::set<FrameId>{{1, 3}, {1, 150}}));
  for (std::uint32_t i = 0; i < 200; ++i) {
    ASSERT_TRUE(map->hot({1, i})) << i;
    EXPECT_EQ(map->hot({1, i})->mean_error, static_cast<float>(i));
    ASSERT_TRUE(map->warm({1, i})) << i;
    ASSERT_TRUE(map->cold({1, i})) << i;
  }
  EXPECT_FALSE(map->hot({1, 200}));
  EXPECT_FALSE(map->hot({2, 0}));
}

}  // namespace
}  // namespace relmap
