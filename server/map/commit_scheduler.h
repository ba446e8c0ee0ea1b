// Decides when the map is committed: after an interval, when much is dirty, when somebody asks for it, and at the end.
//
// The worker encodes what is dirty and goes on while the disk writes it. A commit that is due waits until the previous
// one is written, unless too much is dirty: then the worker waits.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <set>

#include "proto/base/busy_since.h"
#include "proto/base/duration_histogram.h"
#include "proto/base/ids.h"
#include "proto/base/mutex.h"
#include "proto/base/status.h"
#include "storage/engine/engine.h"
#include "storage/map/map.h"
#include "storage/memory/budget.h"

namespace relmap::map {

class CommitScheduler {
 public:
  using Clock = std::chrono::steady_clock;
  struct Hooks {
    // Frames that still wait for their lookup. They are stored with the commit, so that the next start resumes them.
    std::function<std::set<FrameId>()> open_lookups;
    // Called by the worker with the outcome of each commit, without a lock held.
    std::function<void(const Status&)> on_outcome;
    // Called by the worker before and after it waits for a commit that is being written.
    std::function<void(bool waiting)> on_wait;
    // Called by any thread after wants_worker() or done() may have changed, without a lock held.
    std::function<void()> on_change;
  };
  // Must outlive the map given to open(): the map's destructor waits for the commit that is being written, and that
  // commit's thread calls back here when it has finished.
  CommitScheduler(std::chrono::milliseconds interval, std::shared_ptr<storage::Engine> engine,
                  std::shared_ptr<storage::Budget> budget, Hooks hooks);
  CommitScheduler(const CommitScheduler&) = delete;
  CommitScheduler& operator=(const CommitScheduler&) = delete;

  // Thread-safe:

  // Asks the worker for a commit and returns a ticket. The ticket is done once a commit of everything applied before
  // has succeeded or failed (on_outcome was told which), or, after close(), without a commit.
  std::uint64_t ask();
  bool done(std::uint64_t ticket) const;
  // Whether the worker should call run() now: somebody asked for a commit, or a written one waits to be finished.
  bool wants_worker() const;
  // Seconds that the commit has taken so far which is being written; 0: none is.
  double busy_s() const { return busy_.seconds(); }
  // How long commits took until they were written, and how many failed.
  DurationCounts commits() const { return commits_.counts(); }
  std::uint64_t failures() const { return failures_; }
  // Ends committing. Call when a record could not be applied: half of it may be in the map.
  void close() { closed_ = true; }

  // For the thread that opens the map, before there is a worker:
  void open(storage::Map& map) { map_ = &map; }

  // For the worker:
  Clock::time_point next_due() const { return last_ + interval_; }
  // Finishes a written commit; then commits if somebody asked for it, or begins a commit if one is due.
  void run();
  // Begins a commit if one is due.
  void begin_if_due();
  // Commits everything applied and waits until it is written.
  void commit();
  bool failing() const { return failing_; }  // the last commit could not be written

 private:
  bool is_writing() const;
  void begin();
  void finish();
  void note(const Status& outcome);

  const std::chrono::milliseconds interval_;
  const std::shared_ptr<storage::Engine> engine_;
  const std::shared_ptr<storage::Budget> budget_;
  const Hooks hooks_;
  storage::Map* map_ = nullptr;
  Clock::time_point last_ = Clock::now();
  bool failing_ = false;
  std::atomic<bool> closed_ = false;
  BusySince busy_;
  DurationHistogram commits_;
  std::atomic<std::uint64_t> failures_ = 0;

  mutable Mutex mutex_;
  bool under_way_ RELMAP_GUARDED_BY(mutex_) = false;
  std::uint64_t begun_ RELMAP_GUARDED_BY(mutex_) = 0, written_ RELMAP_GUARDED_BY(mutex_) = 0;  // commits, numbered
  std::uint64_t asked_ RELMAP_GUARDED_BY(mutex_) = 0, done_ RELMAP_GUARDED_BY(mutex_) = 0;     // tickets
};

}  // namespace relmap::map
