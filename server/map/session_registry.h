// Gives each session's uuid one number: beginning the same uuid again returns the same number.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <unordered_map>

#include "proto/base/ids.h"
#include "proto/base/mutex.h"
#include "proto/base/status.h"
#include "storage/engine/engine.h"
#include "storage/graph/frame.h"
#include "storage/graph/graph.h"
#include "storage/journal/journal_record.h"
#include "storage/memory/budget.h"

namespace relmap::map {

// Thread-safe, but for load().
class SessionRegistry {
 public:
  // The map as readers see it now.
  using CurrentView = std::function<std::shared_ptr<const storage::Graph>()>;
  // Waits until the record is durable; returns its sequence, or why it is not durable.
  using Journal = std::function<Result<std::uint64_t>(storage::SessionRecord)>;
  // OK, or why the map is read-only.
  using Health = std::function<Status()>;

  SessionRegistry(std::shared_ptr<storage::Engine> engine, std::shared_ptr<storage::Budget> budget, CurrentView view,
                  Journal journal, Health health);
  // Releases the sessions' charge on Share::kSessions.
  ~SessionRegistry();
  SessionRegistry(const SessionRegistry&) = delete;
  SessionRegistry& operator=(const SessionRegistry&) = delete;

  // Loads the sessions of the opened map. `epoch` is the engine's, with which new numbers are allocated. Charges their
  // memory even beyond the share, because it is in use already. Call once, before begin().
  void load(std::uint64_t epoch, std::span<const storage::Session> sessions);

  // Returns the number of the session with this uuid; a new session gets a number and is journalled. SESSION_DELETED,
  // CALIBRATION_CHANGED (it began with another camera or flags), BUDGET_EXCEEDED (no memory for more sessions), or an
  // error of `health`, the engine or the journal.
  Result<SessionNumber> begin(const SessionHeader& header);

 private:
  const std::shared_ptr<storage::Engine> engine_;
  const std::shared_ptr<storage::Budget> budget_;
  const CurrentView view_;
  const Journal journal_;
  const Health health_;
  std::uint64_t epoch_ = 0;

  Mutex mutex_;
  std::unordered_map<SessionUuid, storage::Session> sessions_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::map
