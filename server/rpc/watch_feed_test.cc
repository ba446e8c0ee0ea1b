#include "server/rpc/watch_feed.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "server/rpc/testing/scripted_feed.h"

namespace relmap::rpc {
namespace {

v1::Robot robot(const std::string& name, v1::Reason blocked = v1::REASON_OK, bool silent = false) {
  v1::Robot robot;
  robot.set_uuid("uuid of " + name);
  robot.set_robot(name);
  robot.set_blocked(blocked);
  robot.set_silent(silent);
  return robot;
}

// Counts how often it was woken.
class Waker {
 public:
  Wake wake() {
    return [this] {
      const MutexLock lock(mutex_);
      ++woken_;
      changed_.notify_all();
    };
  }
  int woken() const {
    const MutexLock lock(mutex_);
    return woken_;
  }
  void wait_beyond(int woken) {
    const MutexLock lock(mutex_);
    EXPECT_TRUE(
        changed_.wait_for(mutex_, std::chrono::minutes(10), [&]() RELMAP_REQUIRES(mutex_) { return woken_ > woken; }));
  }

 private:
  mutable Mutex mutex_;
  ConditionVariable changed_;
  int woken_ RELMAP_GUARDED_BY(mutex_) = 0;
};

class WatchFeedTest : public testing::Test {
 protected:
  // The changes of the next wake.
  WatchFeed::Changes next(WatchFeed::Subscription& subscription) {
    for (;;) {
      const int woken = waker_.woken();
      const auto changes = subscription.changes();
      if (changes && (changes->storage || !changes->robots.empty())) return *changes;
      waker_.wait_beyond(woken);
    }
  }

  ScriptedFeed script_;
  WatchFeed feed_{script_.sources()};
  Waker waker_;
};

TEST_F(WatchFeedTest, TellsStorageFirstAndThenWhatChanges) {
  script_.set_robots({robot("old")});
  const auto subscription = feed_.subscribe(waker_.wake());
  auto changes = next(*subscription);
  EXPECT_TRUE(changes.storage->ok());
  EXPECT_TRUE(changes.robots.empty()) << "who was there before is listed, and not told";

  script_.set_storage({Reason::DISK_FULL, "no room"});
  changes = next(*subscription);
  EXPECT_EQ(changes.storage->reason(), Reason::DISK_FULL);

  script_.set_robots({robot("new"), robot("old")});
  changes = next(*subscription);
  ASSERT_EQ(changes.robots.size(), 1u);
  EXPECT_EQ(changes.robots[0]->robot(), "new");
  EXPECT_FALSE(changes.storage);

  script_.set_robots({robot("new", v1::REASON_DISK_FULL), robot("old", v1::REASON_OK, true)});
  changes = next(*subscription);
  ASSERT_EQ(changes.robots.size(), 2u);
  EXPECT_EQ(changes.robots[0]->blocked(), v1::REASON_DISK_FULL);
  EXPECT_TRUE(changes.robots[1]->silent());
}

TEST_F(WatchFeedTest, WhatOnlyCountsIsNoChange) {
  v1::Robot busy = robot("busy");
  script_.set_robots({busy});
  const auto subscription = feed_.subscribe(waker_.wake());
  next(*subscription);
  busy.set_next_sequence(1000);
  busy.set_keyframes_per_s(7);
  script_.set_robots({busy, robot("other")});
  const auto changes = next(*subscription);
  ASSERT_EQ(changes.robots.size(), 1u);
  EXPECT_EQ(changes.robots[0]->robot(), "other");
}

TEST_F(WatchFeedTest, ACommitWakesEverybodyAndSaysWhenItWas) {
  Waker other;
  const auto subscription = feed_.subscribe(waker_.wake()), second = feed_.subscribe(other.wake());
  next(*subscription);
  const std::uint64_t before = subscription->changes()->committed.number;
  const int woken = other.woken();
  script_.commit(42);
  other.wait_beyond(woken);
  const Committed committed = second->changes()->committed;
  EXPECT_EQ(committed.sequence, 42u);
  EXPECT_EQ(committed.number, before + 1);
  EXPECT_GT(committed.time_us, 0);
}

TEST_F(WatchFeedTest, ACommitThatNobodyToldIsFound) {
  const auto subscription = feed_.subscribe(waker_.wake());
  next(*subscription);
  int woken = waker_.woken();
  script_.commit_silently(7);
  while (subscription->changes()->committed.sequence != 7) waker_.wait_beyond(woken++);
}

TEST_F(WatchFeedTest, KnowsWhoIsBehind) {
  const auto one = feed_.subscribe(waker_.wake()), two = feed_.subscribe(waker_.wake());
  script_.commit(100);
  EXPECT_EQ(feed_.counts().lag, 0u) << "nobody has begun";
  one->told_up_to(90);
  two->told_up_to(100);
  EXPECT_EQ(feed_.counts().lag, 10u);
  feed_.count_told(3);
  feed_.count_resync();
  EXPECT_EQ(feed_.counts().told, 3u);
  EXPECT_EQ(feed_.counts().resyncs, 1u);
}

TEST_F(WatchFeedTest, IsQuietWithoutWatchersAndBeginsAgainWithTheNext) {
  feed_.subscribe(waker_.wake()).reset();
  const int woken = waker_.woken();
  script_.commit(1);
  script_.set_robots({robot("came meanwhile")});
  EXPECT_EQ(waker_.woken(), woken);
  const auto subscription = feed_.subscribe(waker_.wake());
  EXPECT_TRUE(next(*subscription).robots.empty());
}

}  // namespace
}  // namespace relmap::rpc
