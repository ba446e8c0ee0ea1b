#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <thread>
#include <vector>

#include "storage/engine/memory_engine.h"
#include "storage/map/map.h"
#include "storage/testing/random_frames.h"

namespace relmap::storage {
namespace {

struct MapViewTest : ::testing::Test {
  std::shared_ptr<Engine> engine = make_memory_engine();
  std::uint64_t epoch = engine->acquire().value();
  std::shared_ptr<Budget> budget;
  std::unique_ptr<Map> map;
  RandomFrames random{7};

  void open(std::size_t limit) {
    budget = std::make_shared<Budget>(limit);
    map = Map::open(engine, epoch, budget).value();
  }
  void begin(SessionNumber number, std::uint32_t frames) {
    Session session;
    session.number = number;
    map->add_session(session);
    for (std::uint32_t i = 0; i < frames; ++i) add({number, i});
  }
  void add(FrameId id) {
    FrameHot hot;
    hot.present = true;
    hot.landmarks.resize(10);
    FrameCold cold;
    cold.picture.resize(2000);
    map->add_frame(id, hot, {}, cold);
    Session& session = map->edit_session(id.session);
    session.last = id.index;
    ++session.frames;
  }
};

TEST_F(MapViewTest, GivesAllFramesOfAChunkAsOneByOne) {
  open(std::size_t{64} << 20);
  begin(1, 100);
  ASSERT_TRUE(map->commit().ok());
  add({1, 130});                          // behind a gap
  map->edit_hot({1, 70}).mean_error = 3;  // on top of what is committed
  const auto view = map->publish();
  for (const ChunkId chunk : {ChunkId{1, 0}, ChunkId{1, 1}, ChunkId{1, 2}, ChunkId{1, 3}, ChunkId{2, 0}}) {
    const Slots<FrameHot> frames = view->hot_frames(chunk);
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
      EXPECT_EQ(frames[slot], view->hot(frame_in(chunk, slot))) << chunk.to_string() << " " << slot;
  }
  EXPECT_EQ(view->hot_frames({1, 1})[6]->mean_error, 3);
  EXPECT_EQ(map->hot_frames({1, 1})[6]->mean_error, 3);
}

// Whoever follows the map hears of an edit before anyone can see it.
TEST_F(MapViewTest, TellsOfEditsBeforeTheyAreSeen) {
  open(std::size_t{64} << 20);
  begin(1, 70);
  std::vector<ChunkId> told;
  map->watch_edits([&](std::uint64_t version, std::span<const ChunkId> chunks) {
    EXPECT_EQ(version, map->view()->version() + 1);
    told.insert(told.end(), chunks.begin(), chunks.end());
  });
  map->publish();
  EXPECT_EQ(told, (std::vector<ChunkId>{{1, 0}, {1, 1}}));
  told.clear();
  map->edit_warm({1, 0});
  map->publish();
  EXPECT_TRUE(told.empty()) << "no hot part";
  map->edit_hot({1, 69}).mean_error = 1;
  ASSERT_TRUE(map->commit().ok());
  EXPECT_EQ(told, (std::vector<ChunkId>{{1, 1}}));
  told.clear();
  map->publish();
  EXPECT_TRUE(told.empty());
}

TEST_F(MapViewTest, IsWhatWasPublishedAndNothingElse) {
  open(std::size_t{64} << 20);
  begin(1, 10);
  EXPECT_FALSE(map->view()->hot({1, 0}));
  const auto first = map->publish();
  map->edit_hot({1, 0}).mean_error = 1;
  EXPECT_EQ(map->hot({1, 0})->mean_error, 1);
  EXPECT_EQ(first->hot({1, 0})->mean_error, -1);
  const auto second = map->publish();
  EXPECT_GT(second->version(), first->version());
  EXPECT_EQ(second->hot({1, 0})->mean_error, 1);
  map->edit_hot({1, 0}).mean_error = 2;
  ASSERT_TRUE(map->commit().ok());
  EXPECT_EQ(first->hot({1, 0})->mean_error, -1);
  EXPECT_EQ(second->hot({1, 0})->mean_error, 1);
  EXPECT_EQ(map->view()->hot({1, 0})->mean_error, 2);
}

TEST_F(MapViewTest, FramesNotEditedAreSharedBetweenViews) {
  open(std::size_t{64} << 20);
  begin(1, 10);
  const auto first = map->publish();
  map->edit_hot({1, 0}).mean_error = 1;
  const auto second = map->publish();
  EXPECT_NE(first->hot({1, 0}), second->hot({1, 0}));
  EXPECT_EQ(first->hot({1, 1}), second->hot({1, 1}));
  EXPECT_EQ(first->warm({1, 0}), second->warm({1, 0}));
}

TEST_F(MapViewTest, AnOldViewIsServedFromTheCacheAsWell) {
  open(std::size_t{64} << 20);
  begin(1, 10);
  ASSERT_TRUE(map->commit().ok());
  const auto old = map->view();
  map->edit_hot({1, 0}).mean_error = 1;
  ASSERT_TRUE(map->commit().ok());
  const auto frame = old->hot({1, 0});
  EXPECT_EQ(frame->mean_error, -1);
  EXPECT_EQ(old->hot({1, 0}), frame) << "read and decoded once";
  EXPECT_EQ(map->view()->hot({1, 0})->mean_error, 1);
}

TEST_F(MapViewTest, AnEditClonesOnceUntilTheNextPublish) {
  open(std::size_t{64} << 20);
  begin(1, 1);
  map->publish();
  FrameHot& edited = map->edit_hot({1, 0});
  EXPECT_EQ(&edited, &map->edit_hot({1, 0}));
  EXPECT_EQ(&edited, map->hot({1, 0}).get());
  map->publish();
  EXPECT_NE(&edited, &map->edit_hot({1, 0}));
}

TEST_F(MapViewTest, KeepsItsStateAndSessions) {
  open(std::size_t{64} << 20);
  begin(1, 3);
  map->state().keyframes = 3;
  const auto view = map->publish();
  begin(2, 1);
  add({1, 3});
  map->state().keyframes = 5;
  ASSERT_TRUE(map->commit().ok());
  EXPECT_EQ(view->state().keyframes, 3u);
  EXPECT_EQ(view->sessions().size(), 1u);
  EXPECT_EQ(view->session(1)->frames, 3u);
  EXPECT_FALSE(view->session(2));
  EXPECT_FALSE(view->hot({2, 0}));
  EXPECT_EQ(map->view()->sessions().size(), 2u);
}

TEST_F(MapViewTest, BytesHeldOnlyByOldViewsAreChargedUntilTheyAreReleased) {
  open(std::size_t{64} << 20);
  begin(1, 10);
  auto old = map->publish();
  EXPECT_EQ(budget->used(Share::kViews), 0u);
  map->edit_hot({1, 0}).mean_error = 1;
  map->publish();
  EXPECT_EQ(budget->used(Share::kViews), memory_bytes(*old->hot({1, 0})));
  map->edit_hot({1, 0}).mean_error = 2;  // nobody holds the version in between
  map->publish();
  EXPECT_EQ(budget->used(Share::kViews), memory_bytes(*old->hot({1, 0})));
  old.reset();
  EXPECT_EQ(budget->used(Share::kViews), 0u);
}

TEST_F(MapViewTest, AnOldViewOverItsShareIsCutOffAndTheNewestNever) {
  open(std::size_t{2} << 20);
  begin(1, 100);
  const auto old = map->publish();
  ASSERT_TRUE(map->commit().ok());
  EXPECT_GT(budget->used(Share::kViews), 0u);  // the cold parts, of which the cache keeps none
  const auto reason = [&] {
    try {
      old->hot({1, 0});
      return Reason::OK;
    } catch (const StatusError& error) {
      return error.status().reason();
    }
  };
  EXPECT_EQ(reason(), Reason::OK);
  std::vector<std::shared_ptr<const MapView>> views;
  for (int round = 0; round < 20 && reason() == Reason::OK; ++round) {
    for (std::uint32_t i = 0; i < 100; ++i) map->edit_hot({1, i}).mean_error = static_cast<float>(round);
    views.push_back(map->publish());
  }
  EXPECT_EQ(reason(), Reason::VIEW_EXPIRED);
  EXPECT_NO_THROW(map->view()->hot({1, 0}));
}

// A writer always edits two frames of different chunks together; readers hold views during commits and evictions.
TEST_F(MapViewTest, StaysConsistentUnderEditsCommitsAndEvictions) {
  open(std::size_t{300} << 10);
  constexpr std::uint32_t kFrames = 3 * kFramesPerChunk;
  begin(1, kFrames);
  ASSERT_TRUE(map->commit().ok());
  std::atomic<bool> done{false};
  std::atomic<int> reads{0};
  const auto reader = [&](std::uint32_t seed) {
    RandomFrames pick(seed);
    while (!done) {
      const auto view = map->view();
      try {
        const FrameId id{1, pick.below(kFrames / 2)}, twin{1, id.index + kFrames / 2};
        const float first = view->hot(id)->mean_error;
        for (int i = 0; i < 20; ++i) {
          EXPECT_EQ(view->hot(twin)->mean_error, first);
          EXPECT_EQ(view->hot(id)->mean_error, first);
          EXPECT_TRUE(view->cold({1, pick.below(kFrames)}));
          EXPECT_TRUE(view->warm(id));
        }
        EXPECT_EQ(view->session(1)->frames, view->state().keyframes + kFrames);
        std::map<std::uint32_t, std::int64_t> times;
        throw_if(view->visit_digests({}, [&](const ChunkDigest& digests) {
          for (const FrameDigest& frame : digests.frames) times[frame_in(digests.id, frame.slot).index] = frame.time_us;
          return true;
        }));
        EXPECT_EQ(times.size(), kFrames);
        EXPECT_EQ(times[id.index], view->hot(id)->time_us);
        EXPECT_EQ(times[twin.index], view->hot(twin)->time_us);
        ++reads;
      } catch (const StatusError& error) {
        EXPECT_EQ(error.status().reason(), Reason::VIEW_EXPIRED);
      }
    }
  };
  std::thread one(reader, 1), two(reader, 2);
  for (int round = 0; round < 400 || reads < 20; ++round) {
    const std::uint32_t index = random.below(kFrames / 2);
    map->edit_hot({1, index}).mean_error = static_cast<float>(round);
    map->edit_hot({1, index + kFrames / 2}).mean_error = static_cast<float>(round);
    map->edit_hot({1, index}).time_us = round;
    ++map->edit_session(1).frames;
    ++map->state().keyframes;
    if (round % 20 == 19) {
      EXPECT_TRUE(map->commit().ok());
    } else {
      map->publish();
    }
  }
  done = true;
  one.join();
  two.join();
  EXPECT_EQ(budget->used(Share::kViews), 0u);
  EXPECT_LE(budget->used(Share::kCache), budget->limit());
}

TEST_F(MapViewTest, AChunkShowsNothingOfTheOneWhoseMemoryItReuses) {
  open(std::size_t{64} << 20);
  begin(1, 2 * kFramesPerChunk);
  ASSERT_TRUE(map->commit().ok());
  map->edit_hot({1, 0}).mean_error = 1;
  auto held = map->publish();
  map->edit_hot({1, 0}).mean_error = 2;
  map->publish();
  held.reset();  // its chunk is a spare now, as it was
  map->edit_hot({1, kFramesPerChunk + 1}).mean_error = 3;
  EXPECT_EQ(map->publish()->hot({1, kFramesPerChunk})->mean_error, -1);
  EXPECT_EQ(map->view()->hot({1, kFramesPerChunk + 1})->mean_error, 3);
}

// The same frames are edited over and over, so that each version is made in the memory of a released one, while readers
// hold views and, for longer, frames.
TEST_F(MapViewTest, WhatIsHeldDoesNotChangeWhileMemoryIsReused) {
  open(std::size_t{64} << 20);
  constexpr std::uint32_t kFrames = 3;
  begin(1, kFrames);
  map->publish();
  std::atomic<bool> done{false};
  std::atomic<int> reads{0};
  const auto same = [](const FrameHot& frame) {
    for (const Landmark& landmark : frame.landmarks)
      if (landmark.abr.z() != frame.landmarks.front().abr.z()) return false;
    return true;
  };
  const auto reader = [&] {
    std::vector<std::shared_ptr<const FrameHot>> held(5);
    std::vector<double> value(held.size(), 0);
    for (std::size_t turn = 0; !done; ++turn) {
      const auto view = map->view();
      const std::size_t k = turn % held.size();
      if (held[k]) {
        EXPECT_EQ(held[k]->landmarks.back().abr.z(), value[k]);
      }
      held[k] = view->hot({1, static_cast<std::uint32_t>(turn % kFrames)});
      value[k] = held[k]->landmarks.front().abr.z();
      EXPECT_TRUE(same(*held[k]));
      EXPECT_EQ(view->hot({1, static_cast<std::uint32_t>(turn % kFrames)}), held[k]);
      ++reads;
    }
  };
  std::thread one(reader), two(reader);
  for (int round = 1; round < 2000 || reads < 1000; ++round) {
    for (std::uint32_t index = 0; index < kFrames; ++index) {
      FrameHot& frame = map->edit_hot({1, index});
      EXPECT_TRUE(same(frame));
      for (Landmark& landmark : frame.landmarks) landmark.abr.z() = round;
    }
    map->publish();
  }
  done = true;
  one.join();
  two.join();
}

TEST_F(MapViewTest, AFrameIsEditedInTheMemoryOfTheVersionBeforeTheLast) {
  open(std::size_t{64} << 20);
  begin(1, 1);
  map->publish();
  const std::weak_ptr<const FrameHot> first = map->hot({1, 0});  // so that its memory is not freed meanwhile
  const FrameHot* const at = first.lock().get();
  map->edit_hot({1, 0}).mean_error = 1;
  map->publish();
  ASSERT_FALSE(first.expired());
  EXPECT_EQ(&map->edit_hot({1, 0}), at);
  EXPECT_EQ(map->view()->hot({1, 0})->mean_error, 1);
}

TEST_F(MapViewTest, OutlivesTheMap) {
  open(std::size_t{64} << 20);
  begin(1, 100);
  ASSERT_TRUE(map->commit().ok());
  const auto view = map->publish();
  map.reset();
  EXPECT_TRUE(view->hot({1, 99}));
  EXPECT_TRUE(view->cold({1, 0}));
}

}  // namespace
}  // namespace relmap::storage
