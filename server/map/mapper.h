// The map at work: journal, worker, lookup. What ingest and RPC handlers talk to.
//
//   submit() -> journal thread: group commit -> durable, `done` called -> worker thread: applied to the map, relaxed,
//   published -> lookup thread: place recognition and verification on a view -> closure proposals, submitted in turn.
//
// All methods are thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/map/camera_doubts.h"
#include "server/map/edge_changes.h"
#include "server/place/place_index.h"
#include "server/place/vocabulary.h"
#include "server/rba/rba.h"
#include "storage/engine/engine.h"
#include "storage/journal/journal_record.h"
#include "storage/map/map.h"
#include "storage/memory/budget.h"

namespace relmap::map {

struct MapperOptions {
  rba::RbaOptions rba;
  // Lookup and idle work at fixed points: the same input gives the same map. Slower: one record at a time.
  bool deterministic = false;
  bool closures = true;  // off: no place recognition (for "before" measurements)
  std::chrono::milliseconds commit_interval{1000};
  std::uint64_t idle_slice = 20000;  // counted work per idle record
  // The data folder: named in messages, and where the place index is kept. Empty: in memory only, within its share.
  std::string folder;
};

struct MapperStats {
  std::uint64_t durable_sequence = 0;  // of the journal
  std::uint64_t applied_sequence = 0;
  std::size_t queued = 0;      // records durable but not applied
  std::size_t lookup_lag = 0;  // keyframes applied but not looked up
  std::size_t places = 0;
  std::size_t places_left_out = 0;   // found no room: they will not be recognised until the next start
  std::uint64_t pending_frames = 0;  // waiting for relaxation
  std::vector<CameraDoubt> doubts;   // sessions whose pictures contradict their calibration
  // Of the last 10,000 keyframes: time the worker spent in relax().
  double rba_p50_us = 0, rba_p99_us = 0, rba_max_us = 0;
  double active_frames_mean = 0;
  std::uint64_t rba_solves = 0;
  // Not ok: why nothing is taken in (READ_ONLY until the next start, anything else until it passes), or why what is
  // taken in cannot be committed.
  Status storage;
};

class Mapper {
 public:
  // Takes the engine, loads the map, re-applies the journal, starts the threads. What was opened for reading only, or
  // cannot be re-applied in full, is served READ_ONLY.
  static Result<std::unique_ptr<Mapper>> open(std::shared_ptr<storage::Engine> engine,
                                              std::shared_ptr<storage::Budget> budget,
                                              std::shared_ptr<const place::Vocabulary> vocabulary,
                                              MapperOptions options);
  // As stop().
  ~Mapper();

  // The number of the session with this uuid; a new one is allocated and journalled. CALIBRATION_CHANGED if it began
  // with another camera or flags.
  Result<SessionNumber> begin_session(const SessionHeader& header);

  // Queues the record for the journal. `done` is called once, from the journal thread, with its sequence when it is
  // durable, or with the reason why it is not. At once, without `done`: BUDGET_EXCEEDED when the queue is full,
  // SHUTTING_DOWN after stop(), and what stats().storage says while the disk takes nothing.
  using Done = std::function<void(const Result<std::uint64_t>&)>;
  Status submit(storage::JournalRecord record, Done done);
  Result<std::uint64_t> submit_and_wait(storage::JournalRecord record);

  // DEADLINE if it is not applied (and visible in view()) by then.
  Status wait_applied(std::uint64_t sequence, std::chrono::steady_clock::time_point deadline) const;
  // What the record changed of the map's edges: of proposals and edits of closures, the last kRemembered of them.
  // nullopt: of no other, and of none that was applied long ago.
  static constexpr std::size_t kRemembered = 256;
  std::optional<std::vector<EdgeChange>> edge_changes(std::uint64_t sequence) const;
  // Until everything submitted is applied and looked up, no relaxation is pending, and what is being deleted has gone
  // (for batch jobs and tests).
  Status wait_idle(std::chrono::steady_clock::time_point deadline) const;

  // What is dirty, now; the last journal sequence that is committed then. DEADLINE, and why a commit fails.
  Result<std::uint64_t> commit(std::chrono::steady_clock::time_point deadline);

  // Calls `watcher` from now on with every closure that awaits confirmation, comes into force, is taken out or goes
  // with a session (not with bridges over one: nothing was recognised), and the map in which it did (for the closure's
  // state), from the worker's thread: it must neither wait nor call back. Recovery repeats nothing. Replaces the
  // watcher; an empty function unregisters it. When this returns, the previous watcher is no longer running.
  using ClosureWatcher = std::function<void(const storage::Graph& map, const storage::Edge& closure)>;
  void watch_closures(ClosureWatcher watcher);

  // As Map::watch_edits(), from the worker's thread. The first watcher is told at once, from the caller's thread, of
  // all that was edited since the map was opened. Replaces the watcher; an empty function unregisters it. When this
  // returns, the previous watcher is no longer running.
  void watch_edits(storage::Map::EditWatcher watcher);

  std::shared_ptr<const storage::MapView> view() const;
  // Which map it is. Not known: it has never been made durable, since nothing can be written.
  const MapIdentity& identity() const;
  const place::PlaceIndex& places() const;      // only with a vocabulary
  const place::Vocabulary& vocabulary() const;  // only with one
  storage::Budget& budget() const;
  storage::Engine& engine() const;
  MapperStats stats() const;

  // Stops taking records, applies what is durable, commits.
  Status stop();

 private:
  struct Impl;
  explicit Mapper(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::map
