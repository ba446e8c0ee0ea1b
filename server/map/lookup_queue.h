// Frames that wait to be looked up (lookup.h), and the threads that look them up.
//
// A frame is open from when it is applied until everything that its lookup found is durable. Frames that are open when
// the map is committed, or when the daemon is killed, are looked up after the next start. A proposal made twice changes
// nothing.
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <thread>
#include <vector>

#include "proto/base/duration_histogram.h"
#include "proto/base/ids.h"
#include "proto/base/mutex.h"
#include "server/map/lookup.h"
#include "storage/graph/frame_range.h"
#include "storage/journal/journal_record.h"
#include "storage/memory/budget.h"

namespace relmap::map {

// While so many frames wait, or so much time passes before they are looked up, robots wait, and send later, instead of
// learning later where they are. The number bounds the memory of what waits, the time how late a robot learns it where
// lookups are slow: where every frame returns to a place, 256 took 9 to 14 s.
inline constexpr std::size_t kMaxWaiting = 256;
inline constexpr std::chrono::milliseconds kMaxLookupLag{4000};

// Thread-safe.
class LookupQueue {
 public:
  // Returns what the lookup of the frame found. `later` tells the frames of other sessions that have been pushed after
  // this one until it is called; each range goes on to the end of its session. Called by several threads at a time.
  // Throws StatusError VIEW_EXPIRED if its view was cut off under memory pressure: the lookup is tried again. After any
  // other exception the frame stays open until the next start.
  using LookUp = std::function<std::vector<storage::JournalRecord>(FrameId, const LaterFrames& later)>;
  // Hands a record to the journal, and calls `done`, from any thread, once it is durable or the disk refused it. Waits
  // only while the journal has no room. False if the daemon stops before, or the map is read-only; `done` is then not
  // called. Called by several threads at a time.
  using Durable = std::function<void(bool)>;
  using Journal = std::function<bool(const storage::JournalRecord&, Durable done)>;

  explicit LookupQueue(std::shared_ptr<storage::Budget> budget, std::chrono::milliseconds max_lag = kMaxLookupLag);
  // Calls stop().
  ~LookupQueue();
  LookupQueue(const LookupQueue&) = delete;
  LookupQueue& operator=(const LookupQueue&) = delete;

  // Starts the threads, or as many as can be started; throws std::system_error if none can. They take the frames in the
  // order in which these were pushed. `on_change` is called, without a lock held, whenever waiting() has changed: by
  // these threads, and by those that call `done`, also after stop(). So the journal must end before the queue does.
  void start(std::size_t threads, LookUp look_up, Journal journal, std::function<void()> on_change);
  // Ends each thread after its present lookup. Open frames stay open; those whose records the journal has taken close
  // when these are durable.
  void stop();

  // Opens the frame and lets a thread look it up.
  void push(FrameId frame);
  // Opens and closes a frame that the caller looks up itself (deterministic mode).
  void open(FrameId frame);
  void close(FrameId frame);
  // Closes the session's frames whose lookup failed: the session is being deleted.
  void forget_failed(SessionNumber session);

  std::set<FrameId> open_frames() const;
  bool is_open(FrameId frame) const;
  // Open frames whose lookup has not failed since the start.
  std::size_t waiting() const;
  std::size_t queued() const;  // those whose lookup has not begun
  bool is_waiting(SessionNumber session) const;
  // For how many seconds the frame that waits longest has been pushed; 0 if none waits.
  double lag_s() const;
  // How long lookups took, those of the caller of open() apart.
  DurationCounts lookups() const { return lookups_.counts(); }
  // Whether no more keyframes should be taken in before some have been looked up: the frames that wait, and the
  // `queued` records that may become such frames, are kMaxWaiting or more, or would take longer than `max_lag`, as
  // lookups have taken recently, or the next of them has waited for longer. A single lookup that takes long, or has to
  // be made again, keeps nobody waiting.
  bool is_full(std::size_t queued) const;

 private:
  // kAgain: the view was cut off. kRefused: the disk did not take what was found.
  enum class End : std::uint8_t { kDone, kJournalled, kAgain, kRefused, kFailed, kStopped };

  // A pushed frame. Tickets count up from push to push.
  struct Pushed {
    FrameId frame;
    std::uint64_t ticket;
  };

  void run();
  End look_up_and_journal(const Pushed& pushed);
  // Hands over all that a lookup found. Returns kJournalled if there was something; it ends when that is durable.
  End journal(const Pushed& pushed, const std::vector<storage::JournalRecord>& found);
  // Ends a lookup, or puts the frame in the queue again.
  void end(const Pushed& pushed, End how);
  // For how long a frame would wait that came after the `queued` records.
  double expected_lag_s(std::size_t queued) const;
  std::vector<storage::FrameRange> later_than(const Pushed& pushed) const;
  void forget_pushed(std::uint64_t ticket) RELMAP_REQUIRES(mutex_);
  void open_locked(FrameId frame) RELMAP_REQUIRES(mutex_);
  void close_locked(FrameId frame) RELMAP_REQUIRES(mutex_);

  const std::shared_ptr<storage::Budget> budget_;
  const std::chrono::milliseconds max_lag_;
  DurationHistogram lookups_;
  mutable Mutex mutex_;
  ConditionVariable changed_;
  std::deque<Pushed> queue_ RELMAP_GUARDED_BY(mutex_);  // for the threads
  std::uint64_t last_ticket_ RELMAP_GUARDED_BY(mutex_) = 0;
  // When frames that are in the queue or being looked up were pushed, by ticket.
  std::map<std::uint64_t, std::chrono::steady_clock::time_point> tickets_ RELMAP_GUARDED_BY(mutex_);
  std::size_t running_ RELMAP_GUARDED_BY(mutex_) = 0;  // threads
  double lookup_s_ RELMAP_GUARDED_BY(mutex_) = 0;      // that a lookup has taken recently, on the average
  // By session, the frames pushed since the oldest of these.
  std::map<SessionNumber, std::deque<Pushed>> pushed_ RELMAP_GUARDED_BY(mutex_);
  std::set<FrameId> open_ RELMAP_GUARDED_BY(mutex_);  // those queued, those being looked up, and those that failed
  std::set<FrameId> failed_ RELMAP_GUARDED_BY(mutex_);
  // No lookup begins before, since what one found could not be written.
  std::chrono::steady_clock::time_point not_before_ RELMAP_GUARDED_BY(mutex_);
  bool stopping_ RELMAP_GUARDED_BY(mutex_) = false;
  LookUp look_up_;
  Journal journal_;
  std::function<void()> on_change_;
  std::vector<std::thread> threads_;
};

}  // namespace relmap::map
