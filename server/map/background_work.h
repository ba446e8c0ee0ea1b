// What the worker does when no record waits: it relaxes pending frames, and removes sessions that are being deleted
// from the map, one chunk at a time. At most one relaxation record and one removal record are submitted and not yet
// applied.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>

#include "proto/base/ids.h"
#include "proto/base/mutex.h"
#include "proto/base/status.h"
#include "storage/graph/frame.h"
#include "storage/journal/journal_record.h"

namespace relmap::map {

class BackgroundWork {
 public:
  static constexpr std::chrono::seconds kLeastOften{5};
  using Done = std::function<void(const Result<std::uint64_t>&)>;
  struct Hooks {
    // Queues a record for the journal, as JournalWriter::submit() does.
    std::function<Status(storage::JournalRecord, Done)> submit;
    // Whether no record waits for the worker. Records from outside go first.
    std::function<bool()> is_quiet;
    // Whether each frame that is to be looked up is being looked up. While some wait, the processor's time is theirs,
    // since robots wait for them: pending frames are then relaxed only once in kLeastOften.
    std::function<bool()> lookups_keep_up;
    // The session as the worker sees it.
    std::function<std::optional<storage::Session>(SessionNumber)> session;
    // Whether frames of the session still wait for their lookup. Its removal waits for these.
    std::function<bool(SessionNumber)> has_waiting_lookups;
    // False while commits fail or too much is dirty (the edits could not be written out), once the map is read-only,
    // and during shutdown.
    std::function<bool()> may_remove;
    // Called by the worker, without a lock held, when nothing is left of the session.
    std::function<void(SessionNumber)> on_gone;
  };
  // `slice` is the counted work of one IdleWorkRecord. Must outlive the journal's writer, whose thread calls back.
  BackgroundWork(std::uint64_t slice, Hooks hooks);
  BackgroundWork(const BackgroundWork&) = delete;
  BackgroundWork& operator=(const BackgroundWork&) = delete;

  // For the thread that opens the map: tells whether frames wait for relaxation.
  void resume(bool relaxation_pending);

  // For the worker:

  // Call after each applied record, with whether frames wait for relaxation now.
  void applied(const storage::JournalRecord& record, bool relaxation_pending);
  // Deterministic mode: the remaining relaxation continues after the next record, and done() does not wait for it.
  void forget_relaxation();
  // Adds the session to those that submit_next() and next_removal() take out chunk by chunk.
  void delete_session(SessionNumber session);
  // Submits the next record of each kind, unless one of that kind is on its way or a record from outside waits.
  void submit_next();
  // The next chunk to take out; nullopt if there is none, or it has to wait. Forgets sessions without frames.
  std::optional<storage::RemoveChunkRecord> next_removal();
  // Whether sessions are being deleted, and may_remove() holds that up.
  bool removal_is_held_back() const;

  // Whether relaxation is pending of which no record is on its way: submit_next() should be called again soon.
  bool relaxation_waits() const;

  // Whether no work is left. Thread-safe.
  bool done() const;

 private:
  // `on_its_way`: set until the record is refused, or applied().
  void submit(storage::JournalRecord record, bool BackgroundWork::*on_its_way);

  const std::uint64_t slice_;
  const Hooks hooks_;

  mutable Mutex mutex_;
  std::chrono::steady_clock::time_point relaxed_at_ RELMAP_GUARDED_BY(mutex_);  // when the last record was submitted
  bool relaxation_pending_ RELMAP_GUARDED_BY(mutex_) = false;
  // A record of that kind is submitted, and neither applied nor refused yet.
  bool relaxation_on_its_way_ RELMAP_GUARDED_BY(mutex_) = false, removal_on_its_way_ RELMAP_GUARDED_BY(mutex_) = false;
  std::set<SessionNumber> going_ RELMAP_GUARDED_BY(mutex_);  // sessions that are being deleted
};

}  // namespace relmap::map
