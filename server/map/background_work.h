// What the worker does when no record waits: frames that are pending are relaxed, and sessions that are being deleted
// leave the map, a chunk at a time. Each piece is a journal record of its own, and one of a kind is on its way at most.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <set>

#include "proto/base/ids.h"
#include "proto/base/status.h"
#include "storage/graph/frame.h"
#include "storage/journal/journal_record.h"

namespace relmap::map {

class BackgroundWork {
 public:
  using Done = std::function<void(const Result<std::uint64_t>&)>;
  struct Hooks {
    // Queues a record for the journal, as JournalWriter::submit() does.
    std::function<Status(storage::JournalRecord, Done)> submit;
    // A session as the worker sees it.
    std::function<std::optional<storage::Session>(SessionNumber)> session;
    // Whether frames of the session wait for their lookup, which are soon through.
    std::function<bool(SessionNumber)> is_looked_up;
    // Whether chunks may be taken out: not while what they edit could not leave memory, and not any more at a stop.
    std::function<bool()> may_remove;
    // A session has gone; by the worker, without a lock held.
    std::function<void(SessionNumber)> on_gone;
  };
  // `slice`: counted work of one record of relaxation.
  BackgroundWork(std::uint64_t slice, Hooks hooks);
  BackgroundWork(const BackgroundWork&) = delete;
  BackgroundWork& operator=(const BackgroundWork&) = delete;

  // By the worker.
  // The map has been opened, and frames are pending, or none.
  void resume(bool relaxation_pending);
  // The same, and a record has been applied.
  void applied(const storage::JournalRecord& record, bool relaxation_pending);
  // What is left waits for the next record (deterministic mode).
  void forget_relaxation();
  // Takes the session out of the map from now on.
  void delete_session(SessionNumber session);
  // Submits the next piece of each kind.
  void submit_next();
  // The next chunk that goes; nullopt: none, or not now.
  std::optional<storage::RemoveChunkRecord> next_removal();

  // Whether nothing is left. By any thread.
  bool done() const;

 private:
  void submit(storage::JournalRecord record, bool& on_its_way);

  const std::uint64_t slice_;
  const Hooks hooks_;

  mutable std::mutex mutex_;
  bool relaxation_pending_ = false;
  bool relaxation_on_its_way_ = false;  // a record of it
  bool removal_on_its_way_ = false;
  std::set<SessionNumber> going_;  // sessions that are being deleted
};

}  // namespace relmap::map
