// What watchers of the map are told that is in no log: that a commit happened, and how storage and robots fare. While
// there are watchers, one thread looks at all that for all of them, and wakes them.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "proto/base/mutex.h"
#include "proto/base/status.h"
#include "server/rpc/producer.h"

namespace relmap::v1 {
class Robot;
}

namespace relmap::map {
class Mapper;
}

namespace relmap::rpc {

struct Intake;

// Up to where the map is committed. Read before a snapshot is taken, it says what the snapshot has at least.
struct Committed {
  std::uint64_t number = 0;    // of commits that were seen; grows with each
  std::uint64_t sequence = 0;  // of the journal
  std::int64_t time_us = 0;    // when, UTC; of a commit before the feed began: when it began
};

// Thread-safe.
class WatchFeed {
 public:
  struct Sources {
    std::function<std::uint64_t()> committed;  // the journal sequence up to which the map is committed
    std::function<Status()> storage;           // why nothing is taken in; OK
    std::function<std::optional<std::vector<v1::Robot>>()> robots;  // as ListRobots answers; may wait; none: it failed
    // Calls the function from now on after each commit; an empty one ends that. May be empty: then commits are noticed
    // within a second.
    std::function<void(std::function<void()>)> on_commit = {};
  };
  static Sources sources_of(map::Mapper& mapper, const Intake& intake);

  // What the sources use must outlive the feed, and whoever subscribes must have gone before it.
  explicit WatchFeed(Sources sources);
  ~WatchFeed();

  struct Changes {
    Committed committed;
    std::optional<Status> storage;                         // if it is another one
    std::vector<std::shared_ptr<const v1::Robot>> robots;  // those that appeared, fell silent or are blocked otherwise
  };
  class Subscription {
   public:
    Subscription(WatchFeed& feed, Wake wake) : feed_(feed), wake_(std::move(wake)) {}
    ~Subscription();
    Subscription(const Subscription&) = delete;
    Subscription& operator=(const Subscription&) = delete;

    // What changed since the last call; at first the state of storage, and no robots. Nullopt while the feed has not
    // looked since the subscription: it wakes.
    std::optional<Changes> changes();
    // Its watcher was told what happened up to this sequence.
    void told_up_to(std::uint64_t sequence) { told_ = sequence; }

   private:
    friend class WatchFeed;
    WatchFeed& feed_;
    const Wake wake_;
    std::atomic<std::uint64_t> told_{UINT64_MAX};  // of those who were told nothing yet
    bool begun_ = false;
    std::uint64_t seen_ = 0;  // the newest change
  };
  // `wake` is called with each commit and each change, until the subscription is destroyed. It must not call back.
  std::unique_ptr<Subscription> subscribe(Wake wake);

  // The sequence up to which the map is committed now; Committed may be a moment older.
  std::uint64_t committed_sequence() const { return sources_.committed(); }

  void count_told(std::uint64_t events) { told_ += events; }
  void count_resync() { ++resyncs_; }
  struct Counts {
    std::uint64_t told = 0, resyncs = 0;  // events and resyncs since the start
    std::uint64_t lag = 0;                // committed records that the slowest watcher has not been told of
  };
  Counts counts() const;

 private:
  struct KnownRobot {
    std::string state;  // what makes a change if it differs
    std::shared_ptr<const v1::Robot> robot;
    std::uint64_t changed = 0;
  };

  void committed();
  Committed last_commit() const;
  void kick();
  void leave(Subscription* subscription);
  void run();
  bool look() RELMAP_REQUIRES(mutex_);
  bool compare(const Status& storage, std::optional<std::vector<v1::Robot>> robots) RELMAP_REQUIRES(mutex_);

  const Sources sources_;
  std::atomic<std::uint64_t> told_{0}, resyncs_{0};

  mutable Mutex mutex_;
  ConditionVariable looked_at_;
  std::set<Subscription*> subscriptions_ RELMAP_GUARDED_BY(mutex_);
  bool looking_ RELMAP_GUARDED_BY(mutex_) = false;  // at the sources, without the mutex
  // How things stood at the last look; not known while there are no watchers.
  bool known_ RELMAP_GUARDED_BY(mutex_) = false;
  std::chrono::steady_clock::time_point looked_ RELMAP_GUARDED_BY(mutex_);
  std::uint64_t change_ RELMAP_GUARDED_BY(mutex_) = 0;  // counts changes
  Status storage_ RELMAP_GUARDED_BY(mutex_);
  std::uint64_t storage_changed_ RELMAP_GUARDED_BY(mutex_) = 0;
  std::map<std::string, KnownRobot> robots_ RELMAP_GUARDED_BY(mutex_);  // by the uuid of their session

  // All that the thread which commits needs, so that it waits for nobody; may be locked with mutex_ held.
  mutable Mutex commit_mutex_;
  ConditionVariable kick_;
  Committed committed_ RELMAP_GUARDED_BY(commit_mutex_);
  bool kicked_ RELMAP_GUARDED_BY(commit_mutex_) = false;  // there is something to do at once
  bool stopping_ RELMAP_GUARDED_BY(commit_mutex_) = false;
  std::thread thread_;  // declared last; begins with the first watcher
};

}  // namespace relmap::rpc
