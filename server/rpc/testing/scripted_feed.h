// For tests: a WatchFeed whose sources say what the test writes, and a log of events in memory.
#pragma once

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "proto/base/mutex.h"
#include "relmap/v1/status.pb.h"
#include "server/rpc/map_watch.h"
#include "server/rpc/watch_feed.h"

namespace relmap::rpc {

// Thread-safe.
class ScriptedFeed {
 public:
  WatchFeed::Sources sources() {
    return {[this] {
              const MutexLock lock(mutex_);
              return committed_;
            },
            [this] {
              const MutexLock lock(mutex_);
              return storage_;
            },
            [this] {
              const MutexLock lock(mutex_);
              return robots_;
            },
            [this](std::function<void()> on_commit) {
              const MutexLock lock(mutex_);
              on_commit_ = std::move(on_commit);
            }};
  }
  // Everything that is appended before it is in the log when it returns.
  void commit(std::uint64_t sequence) {
    std::function<void()> tell;
    {
      const MutexLock lock(mutex_);
      committed_ = sequence;
      tell = on_commit_;
    }
    if (tell) tell();
  }
  // Without telling the feed, which has to find out.
  void commit_silently(std::uint64_t sequence) {
    const MutexLock lock(mutex_);
    committed_ = sequence;
  }
  void set_storage(Status storage) {
    const MutexLock lock(mutex_);
    storage_ = std::move(storage);
  }
  void set_robots(std::vector<v1::Robot> robots) {
    const MutexLock lock(mutex_);
    robots_ = std::move(robots);
  }

 private:
  Mutex mutex_;
  std::uint64_t committed_ RELMAP_GUARDED_BY(mutex_) = 0;
  Status storage_ RELMAP_GUARDED_BY(mutex_);
  std::vector<v1::Robot> robots_ RELMAP_GUARDED_BY(mutex_);
  std::function<void()> on_commit_ RELMAP_GUARDED_BY(mutex_);
};

// Thread-safe. Reads as many events at a time as `per_read` says, whatever bytes are asked for.
class ScriptedLog {
 public:
  explicit ScriptedLog(std::size_t per_read = 1000) : per_read_(per_read) {}

  void append(storage::EventPosition at, storage::EventContent content, std::string author = {}) {
    const MutexLock lock(mutex_);
    events_.push_back({at, {1'000'000 + static_cast<std::int64_t>(at.sequence), std::move(author)}, {}, content});
  }
  // Forgets the first events, up to and including `last`.
  void forget(storage::EventPosition last) {
    const MutexLock lock(mutex_);
    forgotten_ = last;
    std::erase_if(events_, [&](const storage::Event& event) { return event.at <= last; });
  }
  std::size_t reads() const {
    const MutexLock lock(mutex_);
    return reads_;
  }

  EventReader reader() {
    return {[this](storage::EventPosition after, std::size_t) -> Result<storage::EventsRead> {
              const MutexLock lock(mutex_);
              ++reads_;
              storage::EventsRead read;
              read.through = after;
              read.gap = after != storage::EventPosition{} && after < forgotten_;
              for (const storage::Event& event : events_) {
                if (event.at <= after) continue;
                read.more = read.events.size() == per_read_;
                if (read.more) break;
                read.events.push_back(event);
                read.through = event.at;
              }
              return read;
            },
            [this]() -> Result<storage::EventPosition> {
              const MutexLock lock(mutex_);
              return events_.empty() ? forgotten_ : events_.back().at;
            }};
  }

 private:
  const std::size_t per_read_;
  mutable Mutex mutex_;
  std::vector<storage::Event> events_ RELMAP_GUARDED_BY(mutex_);
  storage::EventPosition forgotten_ RELMAP_GUARDED_BY(mutex_);
  std::size_t reads_ RELMAP_GUARDED_BY(mutex_) = 0;
};

}  // namespace relmap::rpc
