// The running map: journal, worker and lookups. Ingest and RPC handlers use this class.
//
//   submit() -> journal thread: group commit -> durable, `done` called -> preparing threads: keyframes are decoded ->
//   worker thread: applied to the map, relaxed, published -> lookup threads: place recognition and verification on a
//   view -> closure proposals, submitted like others
//
// All methods are thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "proto/base/duration_histogram.h"
#include "server/map/camera_doubts.h"
#include "server/map/edge_changes.h"
#include "server/map/way_around.h"
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
  // Makes lookups and idle work at fixed points, so that the same input gives the same map. Slower, since records are
  // written one at a time.
  bool deterministic = false;
  bool closures = true;            // false: no place recognition, to measure what closures improve
  std::size_t lookup_threads = 0;  // threads that recognise places; 0: one fewer than there are cores, but at least one
  std::chrono::milliseconds commit_interval{1000};
  std::uint64_t idle_slice = 20000;  // counted work per idle record
  // The data folder. It is named in messages, and holds the files of the place index. Empty: the index is kept in
  // memory only, within its share.
  std::string folder;
  storage::EventLimits events = {};  // of the log of events
  // Asked again and again while open() does work that can wait until the next start; true: open() leaves it and returns
  // SHUTTING_DOWN. Empty: never.
  std::function<bool()> leaving = {};
};

struct MapperStats {
  std::uint64_t durable_sequence = 0;  // journal sequences
  std::uint64_t applied_sequence = 0;
  std::size_t waiting = 0;     // records submitted but not durable
  std::size_t queued = 0;      // records durable but not applied
  double worker_lag_s = 0;     // for how long the first of these has waited
  std::size_t lookup_lag = 0;  // keyframes applied but not looked up
  double lookup_lag_s = 0;     // for how long the one that waits longest has been in the map, or since the start
  std::size_t places = 0;
  std::size_t places_left_out = 0;   // for lack of memory; they will not be recognised before the next start
  std::uint64_t pending_frames = 0;  // waiting for relaxation
  std::vector<CameraDoubt> doubts;   // sessions whose pictures contradict their calibration
  // Time that the worker spent in relax(), over the last 10,000 keyframes.
  double rba_p50_us = 0, rba_p99_us = 0, rba_max_us = 0;
  double active_frames_mean = 0;
  std::uint64_t rba_solves = 0;
  std::uint64_t commit_failures = 0;
  // Since the start. Acknowledgements: from submit() of a keyframe until it was durable.
  DurationCounts acknowledgements, appends, relaxations, lookups, commits;
  // Not ok: why nothing is taken in (READ_ONLY lasts until the next start, other reasons until the disk recovers), or
  // why commits fail.
  Status storage;
};

// For how many seconds each of the mapper's threads has been at its present piece of work; 0: it waits for one.
struct MapperProgress {
  double journal_s = 0;  // an append, which waits for the disk
  double worker_s = 0;   // applying a record
  double commit_s = 0;   // writing a commit
  double queued_s = 0;   // for how long the first durable record has waited for the worker
  Status storage;        // as MapperStats::storage
};

class Mapper {
 public:
  // Acquires the engine, loads the map, re-applies the journal and starts the threads. A map that can only be read, or
  // whose journal cannot be re-applied in full, is served READ_ONLY. SHUTTING_DOWN if `options.leaving` says so: what
  // was written by then is right.
  static Result<std::unique_ptr<Mapper>> open(std::shared_ptr<storage::Engine> engine,
                                              std::shared_ptr<storage::Budget> budget,
                                              std::shared_ptr<const place::Vocabulary> vocabulary,
                                              MapperOptions options);
  // Calls stop().
  ~Mapper();

  // Returns the number of the session with this uuid; a new session gets a number and is journalled. Fails as
  // SessionRegistry::begin() does.
  Result<SessionNumber> begin_session(const SessionHeader& header);
  // The same without waiting for the disk; `begun` must neither block nor call back.
  using Begun = std::function<void(const Result<SessionNumber>&)>;
  void begin_session(const SessionHeader& header, Begun begun);
  // The number of the session with this uuid; nullopt if it has not begun. view() may not show it yet.
  std::optional<SessionNumber> find_session(const SessionUuid& uuid) const;
  // As storage::Map::hold_session().
  std::shared_ptr<const void> hold_session(SessionNumber session) const;

  // Queues the record for the journal; a record that can say when it was submitted says now, unless it has a time. If
  // the result is OK, `done` is called once, from the journal thread, with the record's sequence when it is durable, or
  // with the reason why it is not. Otherwise `done` is not called: BUDGET_EXCEEDED if the queue is full, SHUTTING_DOWN
  // after stop(), or stats().storage while the disk takes nothing.
  using Done = std::function<void(const Result<std::uint64_t>&)>;
  Status submit(storage::JournalRecord record, Done done);
  Result<std::uint64_t> submit_and_wait(storage::JournalRecord record);

  // Waits until the record is applied and visible in view(). DEADLINE if it is not by then; READ_ONLY if it will not
  // be, since the map has failed.
  Status wait_applied(std::uint64_t sequence, std::chrono::steady_clock::time_point deadline) const;
  // The changes of edges by a record, known for the last kRemembered closure proposals and edits; otherwise nullopt.
  static constexpr std::size_t kRemembered = 256;
  std::optional<std::vector<EdgeChange>> edge_changes(std::uint64_t sequence) const;
  // Waits until everything submitted is applied and looked up, no relaxation is pending, and deletions are complete
  // (for batch jobs and tests). DEADLINE if that takes longer.
  Status wait_idle(std::chrono::steady_clock::time_point deadline) const;

  // Waits until a session that is being deleted has no frames left, but at most until `until`; returns how many it has.
  // The session must exist. READ_ONLY (stats().storage) if it has frames and the map is read-only, so that they stay.
  Result<std::uint64_t> wait_deleted(SessionNumber session, std::chrono::steady_clock::time_point until) const;

  // Commits everything dirty now and returns the last committed journal sequence. DEADLINE, or why the commit failed.
  Result<std::uint64_t> commit(std::chrono::steady_clock::time_point deadline);

  // Calls `watcher` from now on with every closure that becomes a lone candidate, comes into force, is taken out or is
  // deleted with a session, and with the map in which it did. Bridges over deleted sessions are not reported. The call
  // comes from the worker's thread and must neither wait nor call back. Recovery reports nothing again. Replaces the
  // watcher; an empty function unregisters it. When this returns, the previous watcher is no longer running.
  using ClosureWatcher = std::function<void(const storage::Graph& map, const storage::Edge& closure)>;
  void watch_closures(ClosureWatcher watcher);

  // Calls `watcher` from now on as Map::watch_edits() does, from the worker's thread. The first watcher is also called
  // at once, from the caller's thread, with all chunks edited since the map was opened. Replaces the watcher; an empty
  // function unregisters it. When this returns, the previous watcher is no longer running.
  void watch_edits(storage::Map::EditWatcher watcher);

  // Calls `watcher` from now on after each commit, once view()->committed() has it. The call comes from the worker's
  // thread and must neither wait nor call back. Replaces the watcher; an empty function unregisters it. When this
  // returns, the previous watcher is no longer running.
  using CommitWatcher = std::function<void()>;
  void watch_commits(CommitWatcher watcher);

  // Lookups seek ways around stops in this map from now on, unless they are deterministic: then the answer must not
  // depend on which cells exist. What `newest` uses must exist until stop() returns.
  void use_route_map(RouteMap newest);

  // The last edits that had a key when the map was opened, by their sequences in the journal.
  const std::map<std::uint64_t, storage::EditKey>& remembered_edits() const;

  std::shared_ptr<const storage::MapView> view() const;
  // The map's identity. It is not known() while it could not be made durable, because the map cannot be written.
  const MapIdentity& identity() const;
  // Only for a Mapper with a vocabulary:
  const place::PlaceIndex& places() const;
  const place::Vocabulary& vocabulary() const;
  storage::Budget& budget() const;
  storage::Engine& engine() const;
  MapperStats stats() const;
  // What tells whether the map is alive. Waits for no thread that may hang with the disk.
  MapperProgress progress() const;

  // Takes no more records, applies those that are durable, and commits.
  Status stop();

 private:
  struct Impl;
  explicit Mapper(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::map
