#include "server/map/mapper.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <future>
#include <set>
#include <thread>
#include <utility>

#include "proto/base/busy_since.h"
#include "proto/base/clock.h"
#include "proto/base/hex.h"
#include "proto/base/mutex.h"
#include "server/map/background_work.h"
#include "server/map/commit_scheduler.h"
#include "server/map/deletion.h"
#include "server/map/deterministic_driver.h"
#include "server/map/journal_writer.h"
#include "server/map/lookup_queue.h"
#include "server/map/map_builder.h"
#include "server/map/place_recognition.h"
#include "server/map/record_log.h"
#include "server/map/record_queue.h"
#include "server/map/recovery.h"
#include "server/map/session_registry.h"
#include "server/map/timings.h"
#include "server/map/watchers.h"

namespace relmap::map {

namespace {

using Clock = std::chrono::steady_clock;

// Pauses before a record is submitted again.
constexpr std::chrono::milliseconds kQueueFull{5};
constexpr std::chrono::milliseconds kDiskFails{200};
constexpr std::chrono::milliseconds kLookAgain{100};  // before the worker asks again whether lookups keep up

storage::WordFunction words_of(const std::shared_ptr<const place::Vocabulary>& vocabulary) {
  if (!vocabulary) return {};
  return [vocabulary](std::span<const AppearanceFeature> features) { return vocabulary->words(features); };
}

}  // namespace

struct Mapper::Impl {
  Impl(std::shared_ptr<storage::Engine> engine_in, std::shared_ptr<storage::Budget> budget_in,
       std::shared_ptr<const place::Vocabulary> vocabulary_in, MapperOptions options_in)
      : engine(std::move(engine_in)),
        budget(std::move(budget_in)),
        vocabulary(std::move(vocabulary_in)),
        options(std::move(options_in)),
        recognition(vocabulary
                        ? std::make_unique<PlaceRecognition>(vocabulary, budget, options.folder, lookup_threads())
                        : nullptr) {}

  CommitScheduler::Hooks commit_hooks();
  BackgroundWork::Hooks background_hooks();
  DeterministicDriver::Hooks driver_hooks();

  Status load();
  Status make_digests();
  void give_identity();
  void recover();
  void start();
  Status stop();

  Status submit(storage::JournalRecord record, Done done);
  Result<std::uint64_t> submit_and_wait(storage::JournalRecord record);

  // Worker thread.
  void work();
  Clock::time_point next_due() const;
  void apply_one(RecordQueue::Next next);
  void apply_and_publish(std::uint64_t sequence, const storage::JournalRecord& record,
                         std::optional<PreparedKeyframe> prepared);
  void note_applied(std::uint64_t sequence, const storage::JournalRecord& record, Applied& result);
  void catch_up();
  void follow_up(std::uint64_t sequence, std::optional<FrameId> frame, int slices = DeterministicDriver::kSlices);
  void begin_deletion(const storage::Session& session);
  void fail(const std::string& what, const Status& why);
  std::optional<std::uint64_t> append_patiently(const storage::JournalRecord& record);
  std::optional<storage::RemoveChunkRecord> next_removal_patiently();
  bool wait_for_disk();

  // Lookup threads.
  RouteMap newest_map() const {
    const MutexLock lock(mutex);
    return route_map;
  }
  bool submit_patiently(const storage::JournalRecord& record, const LookupQueue::Durable& durable);

  void tell_waiting() const {
    const MutexLock lock(mutex);
    changed.notify_all();
  }
  Status health() const;
  Status keeps_up() const;
  Status storage_status() const {
    const MutexLock lock(mutex);
    return storage;
  }
  bool all_done() const RELMAP_REQUIRES(mutex);
  std::size_t lookup_threads() const {
    const std::size_t all_but_one = std::max(2u, std::thread::hardware_concurrency()) - 1;
    return options.lookup_threads == 0 ? all_but_one : options.lookup_threads;
  }
  bool recognises_places() const { return options.closures && recognition; }

  const std::shared_ptr<storage::Engine> engine;
  const std::shared_ptr<storage::Budget> budget;
  const std::shared_ptr<const place::Vocabulary> vocabulary;
  const MapperOptions options;
  Status read_only;  // not ok: why the engine takes no owner
  std::uint64_t epoch = 0;
  MapIdentity identity;
  std::map<std::uint64_t, storage::EditKey> remembered_edits;

  // The state that threads wait for; `changed` is notified of each change. Declared before the parts below, which call
  // tell_waiting() until they are destroyed.
  mutable Mutex mutex;
  mutable ConditionVariable changed;
  std::uint64_t applied RELMAP_GUARDED_BY(mutex) = 0;
  bool applying RELMAP_GUARDED_BY(mutex) = false;
  bool stopping RELMAP_GUARDED_BY(mutex) = false;       // the worker ends when `durable` is empty
  bool shutting_down RELMAP_GUARDED_BY(mutex) = false;  // waits for the disk are broken off
  Status storage RELMAP_GUARDED_BY(mutex);
  std::deque<std::pair<std::uint64_t, std::vector<EdgeChange>>> edge_changes
      RELMAP_GUARDED_BY(mutex);                 // by sequence, the last kRemembered
  RouteMap route_map RELMAP_GUARDED_BY(mutex);  // empty until use_route_map()
  Timings timings RELMAP_GUARDED_BY(mutex);
  std::uint64_t relaxations RELMAP_GUARDED_BY(mutex) = 0, active_frames RELMAP_GUARDED_BY(mutex) = 0;
  std::atomic<bool> failed = false;
  BusySince worker_busy;
  DurationHistogram relax_times, lookup_times;  // the latter in deterministic mode

  // Declared before the map, whose threads call them.
  CommitScheduler commits{options.commit_interval, engine, budget, commit_hooks()};
  EditAnnouncer edits;
  ClosureAnnouncer closures;
  CommitAnnouncer commits_told;

  std::unique_ptr<storage::Map> map;  // edited by the worker alone
  std::unique_ptr<MapBuilder> builder;
  const std::unique_ptr<PlaceRecognition> recognition;                               // null without a vocabulary
  RecordQueue durable{words_of(vocabulary), budget, one_in_four(lookup_threads())};  // waits for the worker
  LookupQueue lookups{budget};
  BackgroundWork background{options.idle_slice, background_hooks()};
  DeterministicDriver in_step{options.idle_slice, lookups, driver_hooks()};
  SessionRegistry sessions{engine, budget, [this] { return map->view(); },
                           [this](storage::SessionRecord record, SessionRegistry::Durable done) {
                             return submit(std::move(record), std::move(done));
                           },
                           [this] { return failed ? health() : Status(); }};
  std::unique_ptr<JournalWriter> writer;  // declared after everything that its thread calls

  std::thread worker;
  bool stopped = false;
};

CommitScheduler::Hooks Mapper::Impl::commit_hooks() {
  return {.open_lookups = [this] { return lookups.open_frames(); },
          .on_outcome =
              [this](const Status& outcome) {
                {
                  const MutexLock lock(mutex);
                  if (!failed) storage = outcome;
                  changed.notify_all();
                }
                if (outcome.ok()) commits_told.announce();
              },
          .on_wait =
              [this](bool waiting) {  // for the disk, which is told by the commit's own time
                if (waiting)
                  worker_busy.end();
                else
                  worker_busy.begin();
              },
          .on_change = [this] { tell_waiting(); }};
}

BackgroundWork::Hooks Mapper::Impl::background_hooks() {
  return {
      .submit = [this](storage::JournalRecord record,
                       Done done) { return writer->submit(std::move(record), std::move(done)); },
      .is_quiet =
          [this] {
            const MutexLock lock(mutex);
            return durable.empty() && !stopping && !failed;
          },
      .lookups_keep_up = [this] { return lookups.queued() == 0; },
      .session = [this](SessionNumber session) { return map->session(session); },
      .has_waiting_lookups = [this](SessionNumber session) { return lookups.is_waiting(session); },
      .may_remove =
          [this] {  // what a removal edits cannot leave memory while commits fail
            if (commits.failing() || budget->used(storage::Share::kDirty) > budget->allowance(storage::Share::kDirty))
              return false;
            const MutexLock lock(mutex);
            return !failed && !shutting_down;
          },
      .on_gone = [](SessionNumber session) { spdlog::info("session {} is deleted", session); }};
}

DeterministicDriver::Hooks Mapper::Impl::driver_hooks() {
  return {.append = [this](const storage::JournalRecord& record) { return append_patiently(record); },
          .apply =
              [this](std::uint64_t sequence, const storage::JournalRecord& record) {
                worker_busy.begin();
                Applied result = builder->apply(sequence, record);
                note_applied(sequence, record, result);
                closures.announce(*map->view(), result.closures);
              },
          .look_up =
              [this](FrameId frame) {
                const Clock::time_point begun = Clock::now();
                auto found = recognition->look_up(*map->view(), frame);
                for (storage::JournalRecord& record : found) stamp(record);
                lookup_times.add(Clock::now() - begun);
                return found;
              },
          .relaxation_pending = [this] { return !map->state().pending.empty(); },
          .next_removal = [this] { return next_removal_patiently(); }};
}

Status Mapper::Impl::load() {
  const auto acquired = engine->acquire();
  if (acquired.ok())
    epoch = *acquired;
  else if (acquired.reason() == Reason::READ_ONLY || acquired.reason() == Reason::DISK_FULL ||
           acquired.reason() == Reason::IO_ERROR || acquired.reason() == Reason::TOO_MANY_FILES ||
           acquired.reason() == Reason::DATA_LOSS)  // it can still be served
    read_only = acquired.status();
  else
    return acquired.status();
  auto opened = storage::Map::open(engine, epoch, budget, options.events);
  if (!opened.ok()) return opened.status();
  map = *std::move(opened);
  if (read_only.ok() && !map->digests_hold())
    if (Status made = make_digests(); !made.ok()) return made;
  commits.open(*map);
  map->watch_edits(
      [this](std::uint64_t version, std::span<const storage::ChunkId> chunks) { edits.edited(version, chunks); });
  builder = std::make_unique<MapBuilder>(*map, words_of(vocabulary), options.rba);

  const std::uint32_t crc = vocabulary ? vocabulary->crc() : 0;
  storage::MapState& state = map->state();
  if (state.keyframes > 0 && state.vocabulary_crc != crc)
    return {Reason::WRONG_VOCABULARY,
            (state.vocabulary_crc == 0
                 ? "of which vocabulary the map's words are is not known: a reindex was interrupted, or "
                   "a repair lost the map's state (given crc "
                 : "the map's words were made with another vocabulary (crc " + hex(state.vocabulary_crc) + ", given ") +
                hex(crc) + "; relmap-vocab info tells a file's)"};
  state.vocabulary_crc = crc;
  give_identity();
  recover();
  return {};
}

// Makes the digests of a map that a version without them wrote to last, or those that an earlier start did not get to.
// Without them pictures of the map take longer. SHUTTING_DOWN if the daemon is to stop meanwhile.
Status Mapper::Impl::make_digests() {
  using std::chrono::duration;
  const Clock::time_point begun = Clock::now();
  Clock::time_point told = begun;
  const std::uint64_t frames = map->state().keyframes;
  spdlog::info("the map has no digests of its {} frames, or they are of an earlier commit: they are made now", frames);
  bool left = false;
  std::uint64_t done_before_leaving = 0;
  const Status made = map->complete_digests([&](std::uint64_t done, std::uint64_t total) {
    if (const Clock::time_point now = Clock::now(); now - told > std::chrono::seconds(5)) {
      told = now;
      spdlog::info("digests: {} of {} frames", done, total);
    }
    left = options.leaving && options.leaving();
    done_before_leaving = done;
    return !left;
  });
  // They are made once they are committed, which complete_digests() does after it was stopped.
  if (left && made.reason() == Reason::SHUTTING_DOWN)
    spdlog::info("digests of {} of {} frames are made; the next start makes the others", done_before_leaving, frames);
  else if (left)
    spdlog::warn("the digests that were made last could not be kept; the next start makes them again: {}",
                 made.to_string());
  if (left) return {Reason::SHUTTING_DOWN, "the daemon was told to stop while it was starting"};
  if (made.ok())
    spdlog::info("digests of {} frames were made in {:.1f} s", frames, duration<double>(Clock::now() - begun).count());
  else
    spdlog::warn("no digests were made, so pictures of the map take longer, until the next start: {}",
                 made.to_string());
  return {};
}

// Gives a new map its identity. It is told only once it is durable, so that a crash cannot take it back.
void Mapper::Impl::give_identity() {
  storage::MapState& state = map->state();
  identity = state.identity;
  if (identity.known() || !read_only.ok()) return;
  state.identity = {Uuid::random(), static_cast<std::uint64_t>(now_us())};
  if (const Status committed = map->commit(); committed.ok())
    identity = state.identity;
  else
    spdlog::warn("robots are not told which map this is, before the next start: {}", committed.to_string());
}

// Re-applies the journal's records after the last commit. If that fails, the map is served as far as it got.
void Mapper::Impl::recover() {
  const Clock::time_point begun = Clock::now();
  const std::uint64_t committed = map->state().applied_sequence;
  const Replayed replayed = replay(*engine, committed + 1, *builder);
  if (replayed.trouble.ok()) map->publish();
  const auto view = map->view();
  const std::uint64_t through = view->state().applied_sequence;
  {
    const MutexLock lock(mutex);
    applied = through;
  }
  if (through > committed)
    spdlog::info("recovered: journal records {} to {} were applied again, {} keyframes among them, in {:.1f} s",
                 committed + 1, through, replayed.frames.size(),
                 std::chrono::duration<double>(Clock::now() - begun).count());
  remembered_edits = map->edits();
  sessions.load(epoch, *view);
  view->visit_sessions(0, [this](const storage::Session& session) {
    begin_deletion(session);
    return true;
  });
  if (!read_only.ok()) {
    fail("the map could be opened for reading only", read_only);
  } else if (!replayed.trouble.ok()) {
    fail("the journal could not be re-applied beyond record " + std::to_string(through), replayed.trouble);
  } else {
    background.resume(view->pending_frames() > 0);
    if (recognises_places()) find_open_lookups(*view, map->state().lookups, replayed, options.deterministic, lookups);
  }
  // With some words missing, places would silently not be recognised.
  if (recognises_places())
    if (Status loaded = recognition->load(*view); !loaded.ok()) fail("the words of the map's places", loaded);
}

void Mapper::Impl::start() {
  writer = std::make_unique<JournalWriter>(
      engine, epoch, budget, options.deterministic,
      [this](std::vector<DurableRecord> group) {
        durable.push(std::move(group));
        tell_waiting();
      },
      [this] { tell_waiting(); });
  {
    const MutexLock lock(mutex);
    applying = options.deterministic;  // the worker begins with catch_up()
  }
  worker = std::thread([this] { work(); });
  if (recognises_places() && !options.deterministic)
    lookups.start(
        lookup_threads(),
        [this](FrameId frame, const LaterFrames& later) {
          return recognition->look_up(*map->view(), frame, later, newest_map());
        },
        [this](const storage::JournalRecord& record, const LookupQueue::Durable& done) {
          return submit_patiently(record, done);
        },
        [this] { tell_waiting(); });
}

// Deterministic mode: does what an interruption may have left undone.
void Mapper::Impl::catch_up() {
  if (failed) return;
  const std::set<FrameId> open = lookups.open_frames();
  for (const FrameId frame : open) {
    worker_busy.begin();
    follow_up(map->state().applied_sequence, frame);
  }
  constexpr std::uint32_t kAll = DeterministicDriver::kSlices;
  const auto done = static_cast<int>(std::min(map->state().idle_records, kAll));
  if (open.empty()) follow_up(map->state().applied_sequence, std::nullopt, DeterministicDriver::kSlices - done);
}

// When the worker looks for something to do even if no record comes.
Clock::time_point Mapper::Impl::next_due() const {
  const Clock::time_point commit = commits.next_due();
  return background.relaxation_waits() && !failed ? std::min(commit, Clock::now() + kLookAgain) : commit;
}

void Mapper::Impl::work() {
  worker_busy.begin();
  if (options.deterministic) catch_up();
  MutexLock lock(mutex);
  applying = false;
  changed.notify_all();
  for (;;) {
    worker_busy.end();
    changed.wait_until(mutex, next_due(),
                       [&]() RELMAP_REQUIRES(mutex) { return !durable.empty() || stopping || commits.wants_worker(); });
    worker_busy.begin();
    if (durable.empty() && stopping) break;
    if (!durable.empty()) {
      applying = true;
      lock.unlock();
      apply_one(durable.take());
      lock.lock();
      applying = false;
    }
    lock.unlock();
    commits.run();
    if (!options.deterministic) background.submit_next();
    lock.lock();
    changed.notify_all();
  }
  lock.unlock();
  commits.commit();
  worker_busy.end();
}

void Mapper::Impl::apply_one(RecordQueue::Next next) {
  const DurableRecord& record = next.durable;
  if (!failed) apply_and_publish(record.sequence, record.record, std::move(next.prepared));
  if (failed) writer->finished(record.sequence);
  budget->release(storage::Share::kQueues, record.bytes);
}

void Mapper::Impl::apply_and_publish(std::uint64_t sequence, const storage::JournalRecord& record,
                                     std::optional<PreparedKeyframe> prepared) {
  Applied result;
  try {
    result = builder->apply(sequence, record, std::move(prepared));
  } catch (const std::exception&) {
    return fail("journal record " + std::to_string(sequence) + " could not be applied", caught_status());
  }
  if (const std::string line = log_line(*map, record, result); !line.empty()) spdlog::info("{}", line);
  note_applied(sequence, record, result);
  closures.announce(*map->view(), result.closures);
  if (const auto* change = std::get_if<storage::SetSessionStateRecord>(&record))
    if (const auto session = map->session(change->session)) begin_deletion(*session);
  if (!options.deterministic) return;
  // When a session's end is recorded depends on when the robot was heard, so it must not trigger relaxation.
  const bool of_session = std::holds_alternative<storage::SetSessionStateRecord>(record);
  const bool look = result.frame && recognises_places();
  follow_up(sequence, look ? result.frame : std::nullopt, of_session ? 0 : DeterministicDriver::kSlices);
}

// Notes the outcome of an applied record and wakes the threads that wait for it.
void Mapper::Impl::note_applied(std::uint64_t sequence, const storage::JournalRecord& record, Applied& result) {
  background.applied(record, !map->state().pending.empty());
  if (result.frame && recognises_places()) {
    // It is pushed first, so that a lookup knows that it is later before the index has it.
    if (!options.deterministic) lookups.push(*result.frame);
    recognition->add(*result.frame, result.words);
  }
  const MutexLock lock(mutex);
  applied = sequence;
  if (std::holds_alternative<storage::ClosureProposalRecord>(record) ||
      std::holds_alternative<storage::SetEdgeStateRecord>(record)) {
    edge_changes.emplace_back(sequence, std::move(result.edges));
    if (edge_changes.size() > kRemembered) edge_changes.pop_front();
  }
  if (result.frame) {
    timings.add(result.relax_seconds);
    relax_times.add(result.relax_seconds);
    ++relaxations;
    active_frames += result.relaxation.active_frames;
  }
  changed.notify_all();
}

void Mapper::Impl::follow_up(std::uint64_t sequence, std::optional<FrameId> frame, int slices) {
  const DeterministicDriver::Outcome outcome = in_step.follow_up(sequence, frame, slices);
  if (!outcome.trouble.ok())
    fail("what follows from journal record " + std::to_string(sequence) + " could not be applied", outcome.trouble);
  background.forget_relaxation();
  tell_waiting();
  // Something may still follow if the daemon stops: the next start does it before another record is taken.
  const MutexLock lock(mutex);
  if (!shutting_down) writer->finished(outcome.last);
}

// The worker waits a while for the disk, and only commits. False if the daemon stops.
bool Mapper::Impl::wait_for_disk() {
  worker_busy.begin();
  commits.begin_if_due();
  MutexLock lock(mutex);
  return !changed.wait_for(mutex, kDiskFails, [this]() RELMAP_REQUIRES(mutex) { return shutting_down; });
}

// Appends from the worker, once the disk takes the record. Nullopt if the daemon stops first.
std::optional<std::uint64_t> Mapper::Impl::append_patiently(const storage::JournalRecord& record) {
  for (;;) {
    if (const auto appended = writer->append_follow_up(record); appended.ok()) return *appended;
    if (!wait_for_disk()) return std::nullopt;
  }
}

// The next chunk to take out, once the disk takes what its removal edits. Nullopt if there is none, or if the daemon
// stops first.
std::optional<storage::RemoveChunkRecord> Mapper::Impl::next_removal_patiently() {
  while (background.removal_is_held_back())
    if (failed || !wait_for_disk()) return std::nullopt;
  auto removal = background.next_removal();
  if (removal) removal->submitted.time_us = now_us();
  return removal;
}

// Makes the map read-only, for example because a part of it could not be read while a record was applied. Acknowledged
// records stay in the journal and are applied after a restart. Until then the map is served as last published, and
// nothing is taken in or committed.
void Mapper::Impl::fail(const std::string& what, const Status& why) {
  std::string advice = "start the daemon again when the disk is well";
  if (why.reason() == Reason::DATA_LOSS || why.reason() == Reason::IO_ERROR)
    advice = "stop the daemon and run relmap-admin repair " + options.folder;
  else if (why.reason() == Reason::BUDGET_EXCEEDED)
    advice = "start the daemon again with more memory (memory_budget_mb, or of the machine)";
  const Status status(Reason::READ_ONLY, what + ": " + why.to_string() + "; " + advice);
  spdlog::critical("the map is read-only: {}", status.message());
  commits.close();
  const MutexLock lock(mutex);
  storage = status;
  failed = true;  // after `storage`, which is the reason that is given to whoever sees it
  changed.notify_all();
}

void Mapper::Impl::begin_deletion(const storage::Session& session) {
  if (!storage::is_going(session)) return;
  if (recognition) recognition->forget(session.number);
  lookups.forget_failed(session.number);
  if (next_deletion(session)) background.delete_session(session.number);
}

// The queue may be full of robots' keyframes, or the disk may take nothing for a while. False if the daemon stops or
// the map becomes read-only first.
bool Mapper::Impl::submit_patiently(const storage::JournalRecord& record, const LookupQueue::Durable& done) {
  for (;;) {
    const Status submitted = writer->submit(record, [done](const Result<std::uint64_t>& result) { done(result.ok()); });
    if (submitted.ok()) return true;
    if (failed || submitted.reason() == Reason::SHUTTING_DOWN) return false;
    MutexLock lock(mutex);
    const auto pause = submitted.reason() == Reason::BUDGET_EXCEEDED ? kQueueFull : kDiskFails;
    if (changed.wait_for(mutex, pause, [this]() RELMAP_REQUIRES(mutex) { return shutting_down; })) return false;
  }
}

bool Mapper::Impl::all_done() const {
  return writer->idle() && durable.empty() && !applying && applied == writer->durable_through() &&
         lookups.waiting() == 0 && background.done();
}

// As MapperStats::storage.
Status Mapper::Impl::health() const {
  const Status journal = writer->health();
  const MutexLock lock(mutex);
  return journal.ok() || failed ? storage : journal;
}

// BUDGET_EXCEEDED while keyframes come in faster than they are looked up and applied. If that is because the disk takes
// nothing of what is found, the disk's reason.
Status Mapper::Impl::keeps_up() const {
  const char* behind = nullptr;
  // Lookups share the queue's memory, and what they find must still fit in.
  if (lookups.is_full(recognises_places() ? writer->waiting() + durable.size() : 0))
    behind = "place recognition is too far behind";
  else if (durable.lag_s() > static_cast<double>(kMaxWorkerLag.count()))
    behind = "the worker is too far behind";
  if (!behind) return {};
  const Status disk = health();
  return disk.ok() ? Status(Reason::BUDGET_EXCEEDED, behind) : disk;
}

Status Mapper::Impl::submit(storage::JournalRecord record, Done done) {
  if (failed) return health();
  // While commits fail, dirty parts cannot leave memory, so no more is taken in than fits.
  if (budget->used(storage::Share::kDirty) > budget->allowance(storage::Share::kDirty))
    if (Status status = health(); !status.ok()) return status;
  if (std::holds_alternative<storage::KeyframeRecord>(record))
    if (Status pace = keeps_up(); !pace.ok()) return pace;
  return writer->submit(std::move(record), std::move(done));
}

Result<std::uint64_t> Mapper::Impl::submit_and_wait(storage::JournalRecord record) {
  auto promise = std::make_shared<std::promise<Result<std::uint64_t>>>();
  auto future = promise->get_future();
  const Status submitted =
      submit(std::move(record), [promise](const Result<std::uint64_t>& result) { promise->set_value(result); });
  if (!submitted.ok()) return submitted;
  return future.get();
}

Status Mapper::Impl::stop() {
  if (stopped) return storage_status();
  stopped = true;
  if (!writer) return storage_status();  // never started
  {
    const MutexLock lock(mutex);
    shutting_down = true;
    changed.notify_all();
  }
  lookups.stop();
  sessions.stop();
  writer->stop();
  {
    const MutexLock lock(mutex);
    stopping = true;
    changed.notify_all();
  }
  if (worker.joinable()) worker.join();  // start() may have failed before it began
  if (recognition)
    if (const Status saved = recognition->save(); !saved.ok())
      spdlog::warn("the next start reads more of the map for its place index: {}", saved.to_string());
  return storage_status();
}

Mapper::Mapper(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Mapper::~Mapper() { (void)stop(); }

Result<std::unique_ptr<Mapper>> Mapper::open(std::shared_ptr<storage::Engine> engine,
                                             std::shared_ptr<storage::Budget> budget,
                                             std::shared_ptr<const place::Vocabulary> vocabulary,
                                             MapperOptions options) {
  auto impl = std::make_unique<Impl>(std::move(engine), std::move(budget), std::move(vocabulary), options);
  try {
    if (Status loaded = impl->load(); !loaded.ok()) return loaded;
  } catch (const std::exception&) {
    return caught_status();
  }
  std::unique_ptr<Mapper> mapper(new Mapper(std::move(impl)));
  mapper->impl_->start();  // if it throws, the destructor ends the threads that run already
  return mapper;
}

Result<SessionNumber> Mapper::begin_session(const SessionHeader& header) { return impl_->sessions.begin(header); }
void Mapper::begin_session(const SessionHeader& header, Begun begun) {
  impl_->sessions.begin(header, std::move(begun));
}
std::optional<SessionNumber> Mapper::find_session(const SessionUuid& uuid) const { return impl_->sessions.find(uuid); }

std::shared_ptr<const void> Mapper::hold_session(SessionNumber session) const {
  return impl_->map->hold_session(session);
}

Status Mapper::submit(storage::JournalRecord record, Done done) {
  return impl_->submit(std::move(record), std::move(done));
}

Result<std::uint64_t> Mapper::submit_and_wait(storage::JournalRecord record) {
  return impl_->submit_and_wait(std::move(record));
}

const std::map<std::uint64_t, storage::EditKey>& Mapper::remembered_edits() const { return impl_->remembered_edits; }

Status Mapper::wait_applied(std::uint64_t sequence, Clock::time_point deadline) const {
  const auto durable = [&] { return "journal record " + std::to_string(sequence) + " is durable but not applied"; };
  MutexLock lock(impl_->mutex);
  const auto ended = [&]() RELMAP_REQUIRES(impl_->mutex) { return impl_->applied >= sequence || impl_->failed; };
  if (!impl_->changed.wait_until(impl_->mutex, deadline, ended)) return {Reason::DEADLINE, durable() + " yet"};
  if (impl_->applied >= sequence) return {};
  return {impl_->storage.reason(), durable() + ": " + impl_->storage.message()};
}

std::optional<std::vector<EdgeChange>> Mapper::edge_changes(std::uint64_t sequence) const {
  const MutexLock lock(impl_->mutex);
  for (const auto& [of, changes] : impl_->edge_changes)
    if (of == sequence) return changes;
  return std::nullopt;
}

Status Mapper::wait_idle(Clock::time_point deadline) const {
  MutexLock lock(impl_->mutex);
  const auto ended = [this]() RELMAP_REQUIRES(impl_->mutex) { return impl_->all_done() || impl_->failed; };
  if (!impl_->changed.wait_until(impl_->mutex, deadline, ended))
    return {Reason::DEADLINE, "the map is still being worked on"};
  return impl_->failed && !impl_->all_done() ? impl_->storage : Status();
}

Result<std::uint64_t> Mapper::wait_deleted(SessionNumber session, Clock::time_point until) const {
  const auto left = [&] { return std::uint64_t{view()->session(session)->frames}; };
  std::uint64_t frames = left();
  if (frames > 0)
    if (Status health = impl_->health(); health.reason() == Reason::READ_ONLY) return health;
  // Looks without the lock, since a view that is given up may have much to release.
  for (std::uint64_t looked = 0; frames > 0 && Clock::now() < until; frames = left()) {
    MutexLock lock(impl_->mutex);
    impl_->changed.wait_until(impl_->mutex, until,
                              [&]() RELMAP_REQUIRES(impl_->mutex) { return impl_->applied != looked; });
    looked = impl_->applied;
  }
  return frames;
}

Result<std::uint64_t> Mapper::commit(Clock::time_point deadline) {
  const std::uint64_t ticket = impl_->commits.ask();
  MutexLock lock(impl_->mutex);
  if (!impl_->changed.wait_until(impl_->mutex, deadline,
                                 [&]() RELMAP_REQUIRES(impl_->mutex) { return impl_->commits.done(ticket); }))
    return Status(Reason::DEADLINE, "the commit has not come about yet");
  if (!impl_->storage.ok()) return impl_->storage;
  return impl_->engine->applied_sequence();
}

void Mapper::watch_closures(ClosureAnnouncer::Watcher watcher) { impl_->closures.watch(std::move(watcher)); }

void Mapper::watch_commits(CommitWatcher watcher) { impl_->commits_told.watch(std::move(watcher)); }

void Mapper::watch_edits(EditAnnouncer::Watcher watcher) {
  const std::uint64_t told = impl_->edits.watch(std::move(watcher));
  // The edits that the first watcher was told of may not be published yet; the worker publishes them right after.
  MutexLock lock(impl_->mutex);
  impl_->changed.wait(impl_->mutex, [&] { return view()->version() >= told || impl_->failed; });
}

void Mapper::use_route_map(RouteMap newest) {
  const MutexLock lock(impl_->mutex);
  impl_->route_map = std::move(newest);
}

std::shared_ptr<const storage::MapView> Mapper::view() const { return impl_->map->view(); }
const MapIdentity& Mapper::identity() const { return impl_->identity; }
const place::PlaceIndex& Mapper::places() const { return impl_->recognition->places(); }
const place::Vocabulary& Mapper::vocabulary() const { return *impl_->vocabulary; }
storage::Budget& Mapper::budget() const { return *impl_->budget; }
storage::Engine& Mapper::engine() const { return *impl_->engine; }

MapperStats Mapper::stats() const {
  MapperStats stats;
  stats.durable_sequence = impl_->writer->durable_through();
  if (impl_->recognition) {
    stats.places = impl_->recognition->places().size();
    stats.places_left_out = impl_->recognition->places().left_out();
    stats.doubts = impl_->recognition->doubts();
  }
  stats.waiting = impl_->writer->waiting();
  stats.worker_lag_s = impl_->durable.lag_s();
  stats.commit_failures = impl_->commits.failures();
  stats.acknowledgements = impl_->writer->acknowledgements();
  stats.appends = impl_->writer->appends();
  stats.relaxations = impl_->relax_times.counts();
  stats.lookups = impl_->options.deterministic ? impl_->lookup_times.counts() : impl_->lookups.lookups();
  stats.commits = impl_->commits.commits();
  stats.pending_frames = impl_->map->view()->pending_frames();
  const Status journal = impl_->writer->health();
  const MutexLock lock(impl_->mutex);
  stats.storage = journal.ok() || impl_->failed ? impl_->storage : journal;
  stats.applied_sequence = impl_->applied;
  stats.queued = impl_->durable.size();
  stats.lookup_lag = impl_->lookups.waiting();
  stats.lookup_lag_s = impl_->lookups.lag_s();
  stats.rba_p50_us = impl_->timings.quantile(0.5);
  stats.rba_p99_us = impl_->timings.quantile(0.99);
  stats.rba_max_us = impl_->timings.quantile(1);
  stats.rba_solves = impl_->relaxations;
  stats.active_frames_mean =
      impl_->relaxations == 0 ? 0 : static_cast<double>(impl_->active_frames) / static_cast<double>(impl_->relaxations);
  return stats;
}

MapperProgress Mapper::progress() const {
  return {impl_->writer->busy_s(), impl_->worker_busy.seconds(), impl_->commits.busy_s(), impl_->durable.lag_s(),
          impl_->health()};
}

Status Mapper::stop() { return impl_->stop(); }

}  // namespace relmap::map
