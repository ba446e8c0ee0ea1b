// Frames that wait to be looked up (lookup.h), and the thread that looks them up.
//
// A frame is open from when it is applied until everything that its lookup found is durable. Frames that are open when
// the map is committed, or when the daemon is killed, are looked up after the next start. A proposal made twice changes
// nothing.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <set>
#include <thread>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/mutex.h"
#include "storage/journal/journal_record.h"
#include "storage/memory/budget.h"

namespace relmap::map {

// Thread-safe.
class LookupQueue {
 public:
  // Returns what the lookup of the frame found. Throws StatusError VIEW_EXPIRED if its view was cut off under memory
  // pressure: the lookup is tried again. After any other exception the frame stays open until the next start.
  using LookUp = std::function<std::vector<storage::JournalRecord>(FrameId)>;
  // Waits until the record is durable. False if the daemon stops before.
  using Journal = std::function<bool(const storage::JournalRecord&)>;

  explicit LookupQueue(std::shared_ptr<storage::Budget> budget);
  // Calls stop().
  ~LookupQueue();
  LookupQueue(const LookupQueue&) = delete;
  LookupQueue& operator=(const LookupQueue&) = delete;

  // Starts the thread. `on_change` is called by it, without a lock held, whenever waiting() has changed.
  void start(LookUp look_up, Journal journal, std::function<void()> on_change);
  // Ends the thread after the present lookup. Open frames stay open.
  void stop();

  // Opens the frame and lets the thread look it up.
  void push(FrameId frame);
  // Opens and closes a frame that the caller looks up itself (deterministic mode).
  void open(FrameId frame);
  void close(FrameId frame);
  // Closes all open frames and returns them.
  std::set<FrameId> close_all();
  // Closes the session's frames whose lookup failed: the session is being deleted.
  void forget_failed(SessionNumber session);

  std::set<FrameId> open_frames() const;
  bool is_open(FrameId frame) const;
  // Open frames whose lookup has not failed since the start.
  std::size_t waiting() const;
  bool is_waiting(SessionNumber session) const;
  // Whether waiting frames take half of the queues' share of memory, so that no more keyframes should be taken in.
  bool is_full() const;

 private:
  enum class End : std::uint8_t { kDone, kAgain, kFailed, kStopped };

  void run(const LookUp& look_up, const Journal& journal, const std::function<void()>& on_change);
  static End look_up_and_journal(FrameId frame, const LookUp& look_up, const Journal& journal);
  void open_locked(FrameId frame) RELMAP_REQUIRES(mutex_);
  void close_locked(FrameId frame) RELMAP_REQUIRES(mutex_);

  const std::shared_ptr<storage::Budget> budget_;
  mutable Mutex mutex_;
  ConditionVariable changed_;
  std::deque<FrameId> queue_ RELMAP_GUARDED_BY(mutex_);  // for the thread
  std::set<FrameId> open_ RELMAP_GUARDED_BY(mutex_);     // those queued, the one being looked up, and those that failed
  std::set<FrameId> failed_ RELMAP_GUARDED_BY(mutex_);
  bool stopping_ RELMAP_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace relmap::map
