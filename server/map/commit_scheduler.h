// When the map is committed: after an interval, when much is dirty, when somebody asks for it, and at the end.
//
// The worker encodes what is dirty and goes on while the disk writes it; it waits only if the commit before is not
// through yet.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <set>

#include "proto/base/ids.h"
#include "proto/base/status.h"
#include "storage/engine/engine.h"
#include "storage/map/map.h"
#include "storage/memory/budget.h"

namespace relmap::map {

class CommitScheduler {
 public:
  using Clock = std::chrono::steady_clock;
  struct Hooks {
    // The frames whose lookup has to be taken up again after the next start, which the commit writes down.
    std::function<std::set<FrameId>()> open_lookups;
    // What came of a commit; by the worker.
    std::function<void(const Status&)> on_outcome;
    // wants_worker() or done() may have changed; by any thread, without a lock held.
    std::function<void()> on_change;
  };
  // Must outlive the map that it is given: a commit under way, which the map waits for when it ends, says here that it
  // is through.
  CommitScheduler(std::chrono::milliseconds interval, std::shared_ptr<storage::Engine> engine,
                  std::shared_ptr<storage::Budget> budget, Hooks hooks);
  CommitScheduler(const CommitScheduler&) = delete;
  CommitScheduler& operator=(const CommitScheduler&) = delete;

  // By any thread.
  // Asks the worker for a commit; the ticket is done once all that was applied before is committed, or could not be.
  std::uint64_t ask();
  bool done(std::uint64_t ticket) const;
  // Whether run() has something to do before next_due().
  bool wants_worker() const;
  // Nothing is committed any more: half of a record may be in the map, and nobody must see it.
  void close() { closed_ = true; }

  // By the worker.
  void open(storage::Map& map) { map_ = &map; }
  Clock::time_point next_due() const { return last_ + interval_; }
  // Does what is asked for or due, and finishes what is through.
  void run();
  // Begins a commit if one is due.
  void begin_if_due();
  // Commits all that is applied, before it returns.
  void commit();
  bool failing() const { return failing_; }  // the last commit could not be written

 private:
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

  mutable std::mutex mutex_;
  bool under_way_ = false;
  std::uint64_t begun_ = 0, written_ = 0;  // commits, numbered
  std::uint64_t asked_ = 0, done_ = 0;     // tickets
};

}  // namespace relmap::map
