#include "server/map/lookup_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <map>
#include <mutex>
#include <stdexcept>

namespace relmap::map {
namespace {

constexpr std::uint64_t kBudget = 64 << 20;

// A thread that looks frames up as `look_up` says, and a journal that takes everything.
class LookupQueueTest : public ::testing::Test {
 protected:
  void start(std::size_t threads = 1) {
    queue_.start(
        threads,
        [this](FrameId frame, const LaterFrames& later) {
          {
            const std::lock_guard lock(mutex_);
            ++lookups_[frame];
            later_[frame] = later();
          }
          look_up_(frame);
          return std::vector<storage::JournalRecord>{storage::SetLabelRecord{frame, "found", true}};
        },
        [this](const storage::JournalRecord& record, LookupQueue::Durable done) {
          {
            const std::lock_guard lock(mutex_);
            journalled_.push_back(std::get<storage::SetLabelRecord>(record).frame);
            if (holds_back_) {
              held_back_.push_back(std::move(done));
              return true;
            }
          }
          if (journal_takes_) done(true);
          return journal_takes_.load();
        },
        [this] {
          const std::lock_guard lock(mutex_);
          changed_.notify_all();
        });
  }
  void wait() {
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(changed_.wait_for(lock, std::chrono::seconds(60), [this] { return queue_.waiting() == 0; }));
  }
  // Waits until `count` lookups have been handed over, and tells that what they found is durable, or was refused.
  void tell(std::size_t count, bool durable) {
    for (;; std::this_thread::sleep_for(std::chrono::milliseconds(1))) {
      std::vector<LookupQueue::Durable> done;
      {
        const std::lock_guard lock(mutex_);
        if (held_back_.size() < count) continue;
        done.swap(held_back_);
      }
      for (const LookupQueue::Durable& told : done) told(durable);
      return;
    }
  }
  int lookups_of(FrameId frame) {
    const std::lock_guard lock(mutex_);
    return lookups_[frame];
  }

  const std::shared_ptr<storage::Budget> budget_ = std::make_shared<storage::Budget>(kBudget);
  std::function<void(FrameId)> look_up_ = [](FrameId) {};
  std::atomic<bool> journal_takes_ = true;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<FrameId, int> lookups_;
  std::map<FrameId, std::vector<storage::FrameRange>> later_;  // as the last lookup of the frame was told
  std::vector<FrameId> journalled_;
  bool holds_back_ = false;  // the journal does not write what it takes before tell() is called
  std::vector<LookupQueue::Durable> held_back_;
  LookupQueue queue_{budget_};
};

TEST_F(LookupQueueTest, FramesAreLookedUpInOrderAndClosedOnceWhatWasFoundIsDurable) {
  for (std::uint32_t i = 0; i < 3; ++i) queue_.push({1, i});
  EXPECT_EQ(queue_.waiting(), 3u);
  EXPECT_EQ(queue_.open_frames().size(), 3u);
  EXPECT_GT(budget_->used(storage::Share::kQueues), 0u);
  start();
  wait();
  EXPECT_THAT(journalled_, ::testing::ElementsAre(FrameId{1, 0}, FrameId{1, 1}, FrameId{1, 2}));
  EXPECT_TRUE(queue_.open_frames().empty());
  EXPECT_EQ(budget_->used(storage::Share::kQueues), 0u);
}

TEST_F(LookupQueueTest, SeveralThreadsLookUpAtTheSameTimeAndEachFrameOnce) {
  constexpr int kThreads = 3;
  std::atomic<int> inside = 0;
  look_up_ = [&](FrameId) {  // ends once all threads are in it
    ++inside;
    while (inside < kThreads) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  for (std::uint32_t i = 0; i < 40; ++i) queue_.push({1, i});
  start(kThreads);
  wait();
  EXPECT_EQ(journalled_.size(), 40u);
  for (std::uint32_t i = 0; i < 40; ++i) EXPECT_EQ(lookups_of({1, i}), 1) << i;
  EXPECT_TRUE(queue_.open_frames().empty());
  EXPECT_EQ(budget_->used(storage::Share::kQueues), 0u);
}

TEST_F(LookupQueueTest, ALookupIsToldWhichFramesOfOthersCameLater) {
  for (const FrameId frame : {FrameId{1, 5}, FrameId{2, 7}, FrameId{1, 6}, FrameId{2, 8}, FrameId{3, 0}})
    queue_.push(frame);
  start();
  wait();
  const auto firsts = [&](FrameId frame) {
    std::map<SessionNumber, std::uint32_t> first;
    for (const storage::FrameRange& range : later_.at(frame)) first[range.session] = range.first;
    return first;
  };
  using Firsts = std::map<SessionNumber, std::uint32_t>;
  EXPECT_EQ(firsts({1, 5}), (Firsts{{2, 7}, {3, 0}}));
  EXPECT_EQ(firsts({2, 7}), (Firsts{{1, 6}, {3, 0}}));
  EXPECT_EQ(firsts({1, 6}), (Firsts{{2, 8}, {3, 0}}));
  EXPECT_EQ(firsts({3, 0}), Firsts());
  queue_.push({1, 7});
  wait();
  EXPECT_EQ(firsts({1, 7}), Firsts()) << "all others were done";
}

TEST_F(LookupQueueTest, ALookupWhoseViewExpiresIsRepeatedUntilItSucceeds) {
  int left = 7;
  look_up_ = [&](FrameId frame) {
    if (frame == FrameId{1, 0} && left-- > 0) throw StatusError({Reason::VIEW_EXPIRED, "under pressure"});
  };
  start();
  queue_.push({1, 0});
  queue_.push({1, 1});
  wait();
  EXPECT_EQ(lookups_of({1, 0}), 8);
  EXPECT_THAT(journalled_, ::testing::UnorderedElementsAre(FrameId{1, 0}, FrameId{1, 1}));
  EXPECT_TRUE(queue_.open_frames().empty());
}

TEST_F(LookupQueueTest, AFailedLookupDoesNotBlockOthersAndStaysOpenForTheNextStart) {
  look_up_ = [](FrameId frame) {
    if (frame.index == 0) throw StatusError({Reason::DATA_LOSS, "a damaged part"});
    if (frame.index == 1) throw std::runtime_error("anything else");
  };
  for (std::uint32_t i = 0; i < 3; ++i) queue_.push({1, i});
  start();
  wait();
  EXPECT_THAT(journalled_, ::testing::ElementsAre(FrameId{1, 2}));
  EXPECT_THAT(queue_.open_frames(), ::testing::ElementsAre(FrameId{1, 0}, FrameId{1, 1}));
  EXPECT_EQ(lookups_of({1, 0}), 1) << "in vain until the disk is mended";
  EXPECT_FALSE(queue_.is_waiting(1)) << "a deletion may go on";
  queue_.forget_failed(2);
  EXPECT_EQ(queue_.open_frames().size(), 2u);
  queue_.forget_failed(1);
  EXPECT_TRUE(queue_.open_frames().empty());
  EXPECT_EQ(budget_->used(storage::Share::kQueues), 0u);
}

TEST_F(LookupQueueTest, FramesThatFailedDoNotFillTheQueue) {
  look_up_ = [](FrameId) { throw std::runtime_error("each of them"); };
  for (std::uint32_t i = 0; !queue_.is_full(0); ++i) queue_.push({1, i});
  start();
  wait();
  EXPECT_FALSE(queue_.is_full(0));
  EXPECT_TRUE(queue_.is_full(kMaxWaiting)) << "of frames that are not applied yet";
}

TEST_F(LookupQueueTest, TheLagIsThatOfTheFrameThatWaitsLongest) {
  EXPECT_EQ(queue_.lag_s(), 0);
  std::atomic<bool> ends = false;
  look_up_ = [&](FrameId frame) {  // the first outlasts the others
    while (frame.index == 0 && !ends) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  for (std::uint32_t i = 0; i < 3; ++i) queue_.push({1, i});
  start(2);
  while (queue_.waiting() > 1) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_GE(queue_.lag_s(), 0.05);
  ends = true;
  wait();
  EXPECT_EQ(queue_.lag_s(), 0);
}

TEST_F(LookupQueueTest, IsFullOnceTheNextFrameHasWaitedForLong) {
  LookupQueue slow(budget_, std::chrono::milliseconds(20)), patient(budget_, std::chrono::hours(1));
  for (LookupQueue* queue : {&slow, &patient}) queue->push({1, 0});
  while (slow.lag_s() <= 0.02 || patient.lag_s() <= 0.02) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(slow.is_full(0));
  EXPECT_FALSE(patient.is_full(0));
}

TEST_F(LookupQueueTest, IsFullOnceWhatWaitsTakesTooLong) {
  LookupQueue queue(budget_, std::chrono::milliseconds(500));
  std::atomic<std::uint32_t> done = 0;
  std::atomic<bool> goes_on = true;
  queue.start(
      1,
      [&](FrameId frame, const LaterFrames&) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
        while (frame.index >= 100 && !goes_on) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        ++done;
        return std::vector<storage::JournalRecord>{};
      },
      [](const storage::JournalRecord&, const LookupQueue::Durable&) { return true; }, [] {});
  EXPECT_FALSE(queue.is_full(200)) << "nobody knows yet what a lookup takes";
  for (std::uint32_t i = 0; i < 100; ++i) {
    queue.push({1, i});
    while (done <= i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_TRUE(queue.is_full(200)) << "200 take two seconds";
  goes_on = false;
  for (std::uint32_t i = 100; i < 201; ++i) queue.push({1, i});
  EXPECT_TRUE(queue.is_full(0)) << "of the frames that wait it is the same";
  goes_on = true;
}

TEST_F(LookupQueueTest, ALookupThatTakesLongKeepsNobodyWaiting) {
  LookupQueue queue(budget_, std::chrono::milliseconds(20));
  std::atomic<bool> begun = false, ends = false;
  queue.start(
      1,
      [&](FrameId, const LaterFrames&) {
        begun = true;
        while (!ends) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return std::vector<storage::JournalRecord>{};
      },
      [](const storage::JournalRecord&, const LookupQueue::Durable&) { return true; }, [] {});
  queue.push({1, 0});
  while (!begun || queue.lag_s() <= 0.02) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_FALSE(queue.is_full(0));
  ends = true;
}

TEST_F(LookupQueueTest, LookupsGoOnWhileWhatTheOthersFoundIsWritten) {
  holds_back_ = true;
  for (std::uint32_t i = 0; i < 3; ++i) queue_.push({1, i});
  start();
  while (lookups_of({1, 2}) == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(queue_.open_frames().size(), 3u) << "nothing is durable yet";
  EXPECT_GT(queue_.lag_s(), 0);
  tell(3, true);
  wait();
  EXPECT_TRUE(queue_.open_frames().empty());
  EXPECT_EQ(queue_.lag_s(), 0);
  EXPECT_EQ(budget_->used(storage::Share::kQueues), 0u);
}

TEST_F(LookupQueueTest, AFrameIsLookedUpAgainIfTheDiskRefusedWhatWasFound) {
  holds_back_ = true;
  queue_.push({1, 0});
  queue_.push({2, 0});
  start();
  tell(2, false);
  tell(2, true);
  wait();
  EXPECT_EQ(lookups_of({1, 0}), 2);
  EXPECT_EQ(lookups_of({2, 0}), 2);
  EXPECT_TRUE(queue_.open_frames().empty());
}

TEST_F(LookupQueueTest, WhatIsBeingWrittenWhenTheQueueStopsMayStillBecomeDurable) {
  holds_back_ = true;
  queue_.push({1, 0});
  queue_.push({2, 0});
  start();
  while (lookups_of({2, 0}) == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  queue_.stop();
  ASSERT_EQ(held_back_.size(), 2u);
  held_back_[0](true);
  held_back_[1](false);
  EXPECT_FALSE(queue_.is_open({1, 0}));
  EXPECT_TRUE(queue_.is_open({2, 0})) << "it is looked up after the next start";
}

TEST_F(LookupQueueTest, AFrameStaysOpenIfItsRecordsAreNotDurableWhenTheQueueStops) {
  journal_takes_ = false;
  queue_.push({1, 0});
  start();
  while (lookups_of({1, 0}) == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  queue_.stop();
  EXPECT_TRUE(queue_.is_open({1, 0}));
  EXPECT_TRUE(queue_.is_waiting(1));
  EXPECT_EQ(queue_.waiting(), 1u);
}

}  // namespace
}  // namespace relmap::map
