// Gives each session's uuid one number: beginning the same uuid again returns the same number.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/mutex.h"
#include "proto/base/status.h"
#include "proto/base/turn_queue.h"
#include "server/map/session_index.h"
#include "storage/engine/engine.h"
#include "storage/graph/graph.h"
#include "storage/journal/journal_record.h"
#include "storage/memory/budget.h"

namespace relmap::map {

// Thread-safe, but for load(). Callers never wait for the disk: a thread of its own makes numbers durable. Robots take
// turns, so that one that begins sessions without end keeps no other waiting.
class SessionRegistry {
 public:
  // The map as readers see it now.
  using CurrentView = std::function<std::shared_ptr<const storage::Graph>()>;
  // Queues the record, as JournalWriter::submit() does.
  using Durable = std::function<void(const Result<std::uint64_t>&)>;
  using Journal = std::function<Status(storage::SessionRecord, Durable)>;
  // OK, or why the map is read-only.
  using Health = std::function<Status()>;

  SessionRegistry(std::shared_ptr<storage::Engine> engine, std::shared_ptr<storage::Budget> budget, CurrentView view,
                  Journal journal, Health health);
  // Calls stop(), and releases the sessions' charge on Share::kSessions.
  ~SessionRegistry();
  SessionRegistry(const SessionRegistry&) = delete;
  SessionRegistry& operator=(const SessionRegistry&) = delete;

  // Loads the sessions of the opened map. `epoch` is the engine's, with which new numbers are allocated. Charges their
  // memory even beyond the share, because it is in use already. Call once, before begin().
  void load(std::uint64_t epoch, const storage::Graph& map);

  // Calls `begun` once with the number of the session with this uuid; a new session gets a number and is journalled
  // first. The call comes at once where the answer is known, otherwise from a thread of this object or of the journal.
  // SESSION_DELETED, CALIBRATION_CHANGED (it began with another camera or flags), BUDGET_EXCEEDED (no memory for more
  // sessions), SHUTTING_DOWN, or an error of `health`, the engine or the journal.
  using Begun = std::function<void(const Result<SessionNumber>&)>;
  void begin(const SessionHeader& header, Begun begun);
  // Waits for the answer.
  Result<SessionNumber> begin(const SessionHeader& header);

  // The session's number; nullopt if it has not begun. The map may not show it yet.
  std::optional<SessionNumber> find(const SessionUuid& uuid) const;

  // Refuses the sessions that have no number yet, and all later ones. Those that are being journalled are answered by
  // the journal, which has to be stopped next.
  void stop();

 private:
  // A session that has begun, as far as the map does not show it yet, or is about to.
  struct Beginning {
    SessionHeader header;
    SessionNumber number = 0;  // 0: none yet
    std::vector<Begun> waiting;
  };

  void run();
  Result<SessionNumber> new_number();
  void journal(const SessionUuid& uuid, SessionNumber number);
  void finish(const SessionUuid& uuid, const Status& outcome);
  Result<SessionNumber> known(const SessionHeader& header, SessionNumber number,
                              const std::optional<SessionHeader>& unseen) const;
  void forget_seen();

  const std::shared_ptr<storage::Engine> engine_;
  const std::shared_ptr<storage::Budget> budget_;
  const CurrentView view_;
  const Journal journal_;
  const Health health_;
  std::uint64_t epoch_ = 0;
  std::optional<SessionNumber> unused_;  // a number that the journal did not take; of the thread

  mutable Mutex mutex_;
  ConditionVariable wake_;
  SessionIndex index_ RELMAP_GUARDED_BY(mutex_);
  std::map<SessionUuid, Beginning> beginning_ RELMAP_GUARDED_BY(mutex_);     // not durable yet
  TurnQueue<SessionUuid> queue_ RELMAP_GUARDED_BY(mutex_);                   // of these, those without a number
  std::map<SessionNumber, SessionHeader> unseen_ RELMAP_GUARDED_BY(mutex_);  // durable; the map may not show them yet
  bool stopping_ RELMAP_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace relmap::map
