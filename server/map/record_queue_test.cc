#include "server/map/record_queue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <stdexcept>
#include <utility>
#include <vector>

#include "server/map/testing/points_drive.h"

namespace relmap::map {
namespace {

using namespace std::chrono_literals;

sim::PointsWorldOptions described_drive(std::uint32_t frames) {
  sim::PointsWorldOptions options;
  options.frames = frames;
  options.frames_per_lap = 60;
  options.appearance = 20;
  return options;
}

// Keyframes of a drive, with a record of another kind after every third.
std::vector<DurableRecord> records(std::uint32_t frames) {
  const sim::PointsWorld world(described_drive(frames));
  std::vector<DurableRecord> all;
  for (std::uint32_t i = 0; i < frames; ++i) {
    all.push_back({all.size() + 1, keyframe_record(world, i), 10});
    if (i % 3 == 2) all.push_back({all.size() + 1, storage::SetLabelRecord{{kDriveSession, i}, "label", true}, 1});
  }
  return all;
}

std::vector<std::uint32_t> some_words(std::span<const AppearanceFeature> features) {
  std::vector<std::uint32_t> words;
  for (const AppearanceFeature& feature : features) words.push_back(feature.descriptor[0]);
  return words;
}

std::shared_ptr<storage::Budget> budget() { return std::make_shared<storage::Budget>(std::size_t{1} << 20); }

TEST(RecordQueueTest, TheLagIsThatOfTheFirstRecord) {
  RecordQueue queue(some_words, budget(), 1);
  EXPECT_EQ(queue.lag_s(), 0);
  queue.push(records(1));
  std::this_thread::sleep_for(30ms);
  queue.push(records(1));
  EXPECT_GE(queue.lag_s(), 0.03);
  const double before = queue.lag_s();
  (void)queue.take();
  EXPECT_LE(queue.lag_s(), before);
  (void)queue.take();
  EXPECT_EQ(queue.lag_s(), 0);
}

TEST(RecordQueueTest, RecordsLeaveInTheirOrderWithWhatWasPrepared) {
  constexpr std::uint32_t kFrames = 60;
  RecordQueue queue(some_words, budget(), 3);
  for (DurableRecord& record : records(kFrames)) {
    std::vector<DurableRecord> group;
    group.push_back(std::move(record));
    queue.push(std::move(group));
  }
  std::uint64_t sequence = 0;
  for (; !queue.empty(); ++sequence) {
    const RecordQueue::Next next = queue.take();
    EXPECT_EQ(next.durable.sequence, sequence + 1);
    const auto* keyframe = std::get_if<storage::KeyframeRecord>(&next.durable.record);
    EXPECT_EQ(next.durable.bytes, keyframe ? 10u : 1u);
    if (!next.prepared) continue;
    ASSERT_TRUE(keyframe) << "only keyframes are prepared";
    const PreparedKeyframe expected = prepare(*keyframe, some_words);
    ASSERT_TRUE(next.prepared->keyframe.ok());
    EXPECT_EQ(next.prepared->keyframe->sequence, expected.keyframe->sequence);
    EXPECT_EQ(next.prepared->words, expected.words);
    EXPECT_EQ(next.prepared->words.size(), expected.keyframe->appearance.size());
  }
  EXPECT_EQ(sequence, kFrames + kFrames / 3);
}

TEST(RecordQueueTest, ThreadsPrepareAheadOfTheWorkerButNotFarAndAreCharged) {
  constexpr std::uint32_t kFrames = 30;
  std::atomic<std::uint64_t> prepared = 0, taken = 0, too_far = 0;
  const auto memory = budget();
  RecordQueue queue(
      [&](std::span<const AppearanceFeature>) {
        // Of four records in a row one is no keyframe.
        if (++prepared > taken + 4) ++too_far;
        return std::vector<std::uint32_t>{};
      },
      memory, 1);
  queue.push(records(kFrames));
  std::size_t ready = 0;
  for (; !queue.empty(); ++taken) {
    if (taken == 0)
      while (memory->used(storage::Share::kQueues) < 30) std::this_thread::sleep_for(1ms);  // of the first three
    ready += queue.take().prepared.has_value();
  }
  EXPECT_GE(ready, 3u);
  EXPECT_EQ(too_far, 0u);
  EXPECT_EQ(memory->used(storage::Share::kQueues), 0u);
}

TEST(RecordQueueTest, TheWorkerWaitsForAThreadThatIsAtItsRecord) {
  std::promise<void> begun, go_on;
  RecordQueue queue(
      [&, go = go_on.get_future().share()](std::span<const AppearanceFeature>) {
        begun.set_value();
        go.wait();
        return std::vector<std::uint32_t>{7};
      },
      budget(), 1);
  queue.push(records(1));
  begun.get_future().wait();
  auto taken = std::async(std::launch::async, [&] { return queue.take(); });
  EXPECT_EQ(taken.wait_for(10ms), std::future_status::timeout);
  go_on.set_value();
  EXPECT_EQ(taken.get().prepared->words, std::vector<std::uint32_t>{7});
}

TEST(RecordQueueTest, WhatCannotBePreparedIsLeftToTheWorker) {
  RecordQueue queue(
      [](std::span<const AppearanceFeature>) -> std::vector<std::uint32_t> { throw std::runtime_error("no memory"); },
      budget(), 1);
  queue.push(records(1));
  const RecordQueue::Next next = queue.take();
  EXPECT_FALSE(next.prepared);
  EXPECT_EQ(next.durable.sequence, 1u);
  EXPECT_TRUE(queue.empty());
}

}  // namespace
}  // namespace relmap::map
