#include "server/map/mapper.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <future>
#include <mutex>
#include <set>
#include <thread>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "proto/base/clock.h"
#include "proto/keyframe/extension_codec.h"
#include "proto/keyframe/same_camera.h"
#include "server/map/deletion.h"
#include "server/map/journal_writer.h"
#include "server/map/lookup.h"
#include "server/map/lookup_queue.h"
#include "server/map/map_builder.h"
#include "server/map/record_log.h"
#include "server/map/timings.h"

namespace relmap::map {

namespace {

using Clock = std::chrono::steady_clock;

// Relaxation slices after each record in deterministic mode: enough to settle a loop closure, and bounded.
constexpr int kIdleSlicesInStep = 16;

// As relmap-vocab info prints it.
std::string hexadecimal(std::uint32_t crc) { return spdlog::fmt_lib::format("{:08x}", crc); }

constexpr std::chrono::milliseconds kQueueFull{5};  // until a record is submitted again
constexpr std::chrono::milliseconds kDiskFails{200};

// What a session costs beside its frames: in the map's tables, as it was committed, and here.
std::size_t bytes_of(const storage::Session& session) {
  return 3 * (sizeof(storage::Session) + heap_bytes(session.header.unknown) + heap_bytes(session.unknown)) + 768;
}

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
        places(vocabulary ? std::make_unique<place::PlaceIndex>(
                                vocabulary, place::PlaceIndexOptions{budget->allowance(storage::Share::kPlaceIndex),
                                                                     options.folder})
                          : nullptr),
        lookups(budget) {}

  Status load();
  void give_identity();
  Status replay();
  void find_open_lookups(const std::vector<FrameId>& taken_in, bool looked_up);
  Status index_known_places();
  void add_place(FrameId frame, std::span<const std::uint32_t> words);
  void start();
  Status stop();

  void catch_up();

  // Worker thread.
  void work();
  void apply_one(DurableRecord record);
  void apply_and_publish(std::uint64_t sequence, const storage::JournalRecord& record);
  void follow_up(std::uint64_t sequence, std::optional<FrameId> frame, int idle_slices = kIdleSlicesInStep);
  void note(const Applied& applied);
  void remember_changes(std::uint64_t sequence, const storage::JournalRecord& record, Applied& result);
  void announce(const ClosureChange& closures);
  void commit_if_due(Clock::time_point now);
  void begin_commit();
  void finish_commit();
  void commit();
  void note_commit(const Status& outcome);
  void start_idle_work();
  std::optional<storage::RemoveChunkRecord> next_removal();
  void start_deletion();
  void begin_deletion(const storage::Session& session);
  void fail(const std::string& what, const Status& why);
  std::optional<std::uint64_t> append_patiently(const storage::JournalRecord& record);

  // The thread of `lookups`; the worker in deterministic mode.
  std::vector<storage::JournalRecord> look_up_one(FrameId frame);
  void count_doubts(SessionNumber session, const Lookup& found);
  bool journal_patiently(const storage::JournalRecord& record);

  bool all_done_locked() const;
  bool commit_through_locked() const { return !failed && commit_under_way && commit_written == commit_begun; }

  const std::shared_ptr<storage::Engine> engine;
  const std::shared_ptr<storage::Budget> budget;
  const std::shared_ptr<const place::Vocabulary> vocabulary;
  const MapperOptions options;
  std::uint64_t epoch = 0;
  Status read_only;  // not ok: why the engine takes no owner
  MapIdentity identity;

  // Before the map: a commit under way, which the map waits for when it ends, says here that it is through.
  mutable std::mutex mutex;
  mutable std::condition_variable changed;
  bool commit_under_way = false;
  std::uint64_t commit_begun = 0, commit_written = 0;  // the last one's number

  std::unique_ptr<storage::Map> map;  // edited by the worker alone
  std::unique_ptr<MapBuilder> builder;
  const std::unique_ptr<place::PlaceIndex> places;  // null without a vocabulary
  place::PictureCache pictures;                     // of the thread that looks places up
  CameraDoubts doubts;
  std::unique_ptr<JournalWriter> writer;
  LookupQueue lookups;

  std::deque<DurableRecord> durable;  // waiting for the worker
  std::uint64_t applied = 0;
  bool applying = false;
  bool idle_requested = false;      // an idle record is on its way
  std::set<SessionNumber> going;    // sessions that are being deleted
  bool deletion_requested = false;  // a record that takes out a chunk of one is on its way
  std::uint64_t commits_asked = 0, commits_done = 0;
  bool relaxation_pending = false;
  bool stopping = false;       // the worker ends when `durable` is empty
  bool shutting_down = false;  // nothing waits for the disk any more
  Status storage;
  std::deque<std::pair<std::uint64_t, std::vector<EdgeChange>>> edge_changes;  // by record, the last ones
  Timings timings;
  std::uint64_t relaxations = 0, active_frames = 0;

  std::mutex watcher_mutex;
  ClosureWatcher closure_watcher;
  storage::Map::EditWatcher edit_watcher;
  std::uint64_t edits_told = 0;  // guarded by watcher_mutex, as these
  bool edits_watched = false;    // there was a watcher
  std::unordered_set<storage::ChunkId> edits_untold;

  std::mutex sessions_mutex;
  std::unordered_map<SessionUuid, storage::Session> sessions;

  Clock::time_point last_commit = Clock::now();  // worker
  bool commits_fail = false;                     // worker
  bool patient = false;                          // worker: it runs, and may wait for the disk
  std::atomic<bool> failed = false;
  std::thread worker;
  bool stopped = false;
};

Status Mapper::Impl::load() {
  const auto acquired = engine->acquire();
  if (acquired.ok())
    epoch = *acquired;
  else if (acquired.reason() == Reason::READ_ONLY || acquired.reason() == Reason::DISK_FULL ||
           acquired.reason() == Reason::IO_ERROR || acquired.reason() == Reason::DATA_LOSS)  // it can still be served
    read_only = acquired.status();
  else
    return acquired.status();
  auto opened = storage::Map::open(engine, epoch, budget);
  if (!opened.ok()) return opened.status();
  map = *std::move(opened);
  map->watch_edits([this](std::uint64_t version, std::span<const storage::ChunkId> chunks) {
    const std::lock_guard lock(watcher_mutex);
    edits_told = version;
    if (edit_watcher)
      edit_watcher(version, chunks);
    else if (!edits_watched)
      edits_untold.insert(chunks.begin(), chunks.end());
  });
  builder = std::make_unique<MapBuilder>(*map, words_of(vocabulary), options.rba);

  const std::uint32_t crc = vocabulary ? vocabulary->crc() : 0;
  storage::MapState& state = map->state();
  if (state.keyframes > 0 && state.vocabulary_crc != crc)
    return {Reason::WRONG_VOCABULARY,
            (state.vocabulary_crc == 0
                 ? "of which vocabulary the map's words are is not known: a reindex was interrupted, or "
                   "a repair lost the map's state (given crc "
                 : "the map's words were made with another vocabulary (crc " + hexadecimal(state.vocabulary_crc) +
                       ", given ") +
                hexadecimal(crc) + "; relmap-vocab info tells a file's)"};
  state.vocabulary_crc = crc;
  give_identity();
  return replay();
}

// Nobody is told of an identity that a crash might take back.
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

// Re-applies what the journal holds beyond the last commit. Where it cannot go on, the map is served as far as it got.
Status Mapper::Impl::replay() {
  const Clock::time_point begun = Clock::now();
  const std::uint64_t committed = map->state().applied_sequence;
  std::vector<FrameId> taken_in;
  bool looked_up = true;  // the last of them
  Status trouble;
  try {
    const Status read =
        engine->read_journal(map->state().applied_sequence + 1, [&](std::uint64_t sequence, ByteSpan bytes) {
          auto decoded = storage::decode_record(bytes);
          if (!decoded.ok()) {
            trouble = Status(Reason::DATA_LOSS,
                             "journal record " + std::to_string(sequence) + ": " + decoded.status().message());
            return false;
          }
          const Applied result = builder->apply(sequence, decoded->record);
          if (result.frame) taken_in.push_back(*result.frame);
          looked_up = !result.frame;  // what comes next had to wait for it, if it was done in step
          return true;
        });
    if (trouble.ok()) trouble = read;
  } catch (const StatusError& error) {
    trouble = error.status();
  } catch (const std::exception& error) {  // as at run time: a record that cannot be applied does not end the start
    trouble = Status(Reason::INTERNAL, error.what());
  }
  if (trouble.ok()) map->publish();
  const auto view = map->view();
  applied = view->state().applied_sequence;
  if (applied > committed)
    spdlog::info("recovered: journal records {} to {} were applied again, {} keyframes among them, in {:.1f} s",
                 committed + 1, applied, taken_in.size(), std::chrono::duration<double>(Clock::now() - begun).count());
  for (const storage::Session& session : view->sessions()) sessions[session.header.uuid] = session;
  for (const auto& [uuid, session] : sessions) begin_deletion(session);
  for (const auto& [uuid, session] : sessions) budget->charge(storage::Share::kSessions, bytes_of(session));
  if (!read_only.ok()) {
    fail("the map could be opened for reading only", read_only);
  } else if (!trouble.ok()) {
    fail("the journal could not be re-applied beyond record " + std::to_string(applied), trouble);
  } else {
    relaxation_pending = view->pending_frames() > 0;
    find_open_lookups(taken_in, looked_up);
  }
  // Without all the words, places would be missed in silence.
  if (Status indexed = index_known_places(); !indexed.ok()) fail("the words of the map's places", indexed);
  return {};
}

// Frames whose lookup may not have been done, or may not have reached the journal. A proposal made twice changes
// nothing.
void Mapper::Impl::find_open_lookups(const std::vector<FrameId>& taken_in, bool looked_up) {
  if (!options.closures || !places) return;
  const std::set<FrameId>& known = map->state().lookups;
  if (options.deterministic) {  // every lookup was done before the next keyframe was taken in
    for (const FrameId frame : known) lookups.open(frame);
    if (!taken_in.empty() && !looked_up) lookups.open(taken_in.back());
    return;
  }
  std::set<FrameId> open = known;
  open.insert(taken_in.begin(), taken_in.end());
  for (const FrameId frame : open) lookups.push(frame);
}

Status Mapper::Impl::index_known_places() {
  if (!options.closures || !places) return {};
  const auto view = map->view();
  if (const Status restored = places->restore(*view); !restored.ok())
    spdlog::warn("the place index is made again from the map, in part or whole: {}", restored.to_string());
  const auto is_known = [&](FrameId frame) { return places->contains(frame); };
  const Status scanned = view->scan_words(is_known, [&](FrameId frame, std::span<const std::uint32_t> words) {
    if (lookups.is_open(frame)) return;
    if (!words.empty()) return add_place(frame, words);
    // A repair leaves no words where they were lost: they are made anew from the features, if there are any.
    const auto cold = view->cold(frame);
    if (cold && !cold->appearance.empty()) add_place(frame, vocabulary->words(cold->appearance));
  });
  budget->set(storage::Share::kPlaceIndex, places->memory_bytes());
  return scanned;
}

void Mapper::Impl::add_place(FrameId frame, std::span<const std::uint32_t> words) {
  const Status added = places->add(frame, words);
  if (!added.ok() && places->left_out() == 1)
    spdlog::error("frame {} will not be recognised, and others after it: {}", frame.to_string(), added.to_string());
  budget->set(storage::Share::kPlaceIndex, places->memory_bytes());
}

void Mapper::Impl::start() {
  writer = std::make_unique<JournalWriter>(engine, epoch, budget, options.deterministic,
                                           [this](std::vector<DurableRecord> group) {
                                             const std::lock_guard lock(mutex);
                                             for (DurableRecord& record : group) durable.push_back(std::move(record));
                                             changed.notify_all();
                                           });
  if (options.deterministic) catch_up();
  patient = true;
  worker = std::thread([this] { work(); });
  if (options.closures && places && !options.deterministic)
    lookups.start([this](FrameId frame) { return look_up_one(frame); },
                  [this](const storage::JournalRecord& record) { return journal_patiently(record); },
                  [this] {
                    const std::lock_guard lock(mutex);
                    changed.notify_all();
                  });
}

// Deterministic mode: what an interruption may have left out.
void Mapper::Impl::catch_up() {
  if (failed) return;
  const std::set<FrameId> open = lookups.close_all();
  for (const FrameId frame : open) follow_up(applied, frame);
  const auto done = static_cast<int>(std::min<std::uint32_t>(map->state().idle_records, kIdleSlicesInStep));
  if (open.empty()) follow_up(applied, std::nullopt, kIdleSlicesInStep - done);
}

void Mapper::Impl::work() {
  std::unique_lock lock(mutex);
  for (;;) {
    const auto wake = last_commit + options.commit_interval;
    changed.wait_until(lock, wake, [&] {
      return !durable.empty() || stopping || commit_through_locked() || commits_done < commits_asked;
    });
    if (durable.empty() && stopping) break;
    if (!durable.empty()) {
      DurableRecord record = std::move(durable.front());
      durable.pop_front();
      applying = true;
      lock.unlock();
      apply_one(std::move(record));
      lock.lock();
      applying = false;
    }
    const bool quiet = durable.empty();
    const bool asked = commits_done < commits_asked;
    const bool through = commit_through_locked();
    lock.unlock();
    if (through) finish_commit();
    if (asked)
      commit();
    else
      commit_if_due(Clock::now());
    if (quiet && !options.deterministic) {
      start_idle_work();
      start_deletion();
    }
    lock.lock();
    changed.notify_all();
  }
  lock.unlock();
  commit();
}

void Mapper::Impl::apply_one(DurableRecord record) {
  if (!failed) apply_and_publish(record.sequence, record.record);
  if (failed) writer->settled(record.sequence);
  budget->release(storage::Share::kQueues, record.bytes);
}

void Mapper::Impl::apply_and_publish(std::uint64_t sequence, const storage::JournalRecord& record) {
  Applied result;
  try {
    result = builder->apply(sequence, record);
  } catch (const StatusError& error) {
    return fail("journal record " + std::to_string(sequence) + " could not be applied", error.status());
  } catch (const std::exception& error) {
    return fail("journal record " + std::to_string(sequence) + " could not be applied",
                {Reason::INTERNAL, error.what()});
  }
  if (const std::string line = log_line(*map, record, result); !line.empty()) spdlog::info("{}", line);
  const bool look = result.frame && options.closures && places;
  {
    const std::lock_guard lock(mutex);
    applied = sequence;
    remember_changes(sequence, record, result);
    note(result);
    relaxation_pending = !map->state().pending.empty();
    if (std::holds_alternative<storage::IdleWorkRecord>(record)) idle_requested = false;
    if (std::holds_alternative<storage::RemoveChunkRecord>(record)) deletion_requested = false;
    if (look && !options.deterministic) lookups.push(*result.frame);
    changed.notify_all();
  }
  announce(result.closures);
  if (const auto* change = std::get_if<storage::SetSessionStateRecord>(&record))
    if (const auto session = map->session(change->session)) begin_deletion(*session);
  if (!options.deterministic) return;
  // When a session's end is said depends on who was there to hear it: nothing that moves may.
  const bool of_session = std::holds_alternative<storage::SetSessionStateRecord>(record);
  follow_up(sequence, look ? result.frame : std::nullopt, of_session ? 0 : kIdleSlicesInStep);
}

// Deterministic mode: the lookup of a new frame and the relaxation that is left, right after the record that caused
// them.
void Mapper::Impl::follow_up(std::uint64_t sequence, std::optional<FrameId> frame, int idle_slices) {
  std::uint64_t last = sequence;
  const auto append_and_apply = [&](const storage::JournalRecord& record) {
    const auto appended = append_patiently(record);
    if (!appended) return false;
    last = *appended;
    Applied result = builder->apply(last, record);
    {
      const std::lock_guard lock(mutex);
      applied = last;
      remember_changes(last, record, result);
      note(result);
    }
    announce(result.closures);
    return true;
  };
  try {
    if (frame) {
      lookups.open(*frame);  // if it is not finished, the next start takes it up again
      const std::vector<storage::JournalRecord> found = look_up_one(*frame);
      if (std::all_of(found.begin(), found.end(), append_and_apply)) lookups.close(*frame);
    }
    const auto relax = [&](int slices) {
      for (int slice = 0; slice < slices && !map->state().pending.empty(); ++slice)
        if (!append_and_apply(storage::IdleWorkRecord{options.idle_slice})) break;
    };
    relax(idle_slices);
    while (const auto removal = next_removal()) {
      if (!append_and_apply(*removal)) break;
      relax(kIdleSlicesInStep);
    }
  } catch (const StatusError& error) {
    fail("what follows from journal record " + std::to_string(sequence) + " could not be applied", error.status());
  } catch (const std::exception& error) {
    fail("what follows from journal record " + std::to_string(sequence) + " could not be applied",
         {Reason::INTERNAL, error.what()});
  }
  {
    const std::lock_guard lock(mutex);
    relaxation_pending = false;  // what is left waits for the next record
    changed.notify_all();
  }
  writer->settled(last);
}

// While the disk takes nothing the worker waits with it, and only commits. nullopt: the daemon stops before it does, or
// has not started yet.
std::optional<std::uint64_t> Mapper::Impl::append_patiently(const storage::JournalRecord& record) {
  for (;;) {
    if (const auto appended = writer->append_follow_up(record); appended.ok()) return *appended;
    if (!patient) return std::nullopt;
    commit_if_due(Clock::now());
    std::unique_lock lock(mutex);
    if (changed.wait_for(lock, kDiskFails, [this] { return shutting_down; })) return std::nullopt;
  }
}

// A part of the map could not be read while a record was applied. What is acknowledged stays in the journal and is
// applied after a restart; until then the map is served as it was last published, and nothing more is taken in or
// committed.
void Mapper::Impl::fail(const std::string& what, const Status& why) {
  std::string advice = "start the daemon again when the disk is well";
  if (why.reason() == Reason::DATA_LOSS || why.reason() == Reason::IO_ERROR)
    advice = "stop the daemon and run relmap-admin repair " + options.folder;
  const Status status(Reason::READ_ONLY, what + ": " + why.to_string() + "; " + advice);
  spdlog::critical("the map is read-only: {}", status.message());
  const std::lock_guard lock(mutex);
  storage = status;
  failed = true;  // once the reason is there: who sees it is refused by that reason
  changed.notify_all();
}

void Mapper::Impl::note(const Applied& result) {
  if (!result.frame) return;
  timings.add(result.relax_seconds);
  ++relaxations;
  active_frames += result.relaxation.active_frames;
}

void Mapper::Impl::remember_changes(std::uint64_t sequence, const storage::JournalRecord& record, Applied& result) {
  if (!std::holds_alternative<storage::ClosureProposalRecord>(record) &&
      !std::holds_alternative<storage::SetEdgeStateRecord>(record))
    return;
  edge_changes.emplace_back(sequence, std::move(result.edges));
  if (edge_changes.size() > kRemembered) edge_changes.pop_front();
}

// What nobody hears is not missed: the map is what counts.
void Mapper::Impl::announce(const ClosureChange& closures) {
  if (closures.accepted.empty() && closures.out_of_force.empty() && closures.lone.empty() && closures.gone.empty())
    return;
  const std::lock_guard lock(watcher_mutex);
  if (!closure_watcher) return;
  const auto view = map->view();
  for (const auto& ids : {closures.lone, closures.accepted, closures.out_of_force})
    for (const EdgeId id : ids) try {
        closure_watcher(*view, *view->hot(id.frame)->edge(id));
      } catch (const std::exception& error) {
        spdlog::warn("closure {} is not announced: {}", id.to_string(), error.what());
      }
  for (const storage::Edge& edge : closures.gone) try {
      closure_watcher(*view, edge);
    } catch (const std::exception& error) {
      spdlog::warn("that closure {} is gone is not announced: {}", edge.id.to_string(), error.what());
    }
}

void Mapper::Impl::commit_if_due(Clock::time_point now) {
  const bool due = now >= last_commit + options.commit_interval;
  if (due || (!commits_fail && map->commit_is_due())) begin_commit();
}

// The worker goes on while the disk writes; it waits here only if the commit before is not through yet.
void Mapper::Impl::begin_commit() {
  last_commit = Clock::now();
  if (failed) return;  // half of a record may be in the map: nobody must see it
  if (commits_fail) finish_commit();
  std::uint64_t number = 0;
  {
    const std::lock_guard lock(mutex);
    if (std::set<FrameId> open = lookups.open_frames(); map->state().lookups != open)
      map->state().lookups = std::move(open);
    number = ++commit_begun;
    commit_under_way = true;
  }
  Status begun;
  try {
    begun = map->begin_commit([this, number] {
      const std::lock_guard lock(mutex);
      commit_written = number;
      changed.notify_all();
    });
  } catch (const std::exception& error) {
    begun = {Reason::INTERNAL, error.what()};
  }
  budget->set(storage::Share::kEngine, engine->memory_bytes());
  if (begun.ok()) return;
  finish_commit();  // the one before, if it is not that which failed
  {
    const std::lock_guard lock(mutex);
    commit_under_way = false;
  }
  note_commit(begun);
}

void Mapper::Impl::finish_commit() {
  if (failed) return;
  const std::optional<Status> outcome = map->finish_commit();
  if (!outcome) return;
  budget->set(storage::Share::kEngine, engine->memory_bytes());
  {
    const std::lock_guard lock(mutex);
    commit_under_way = false;
  }
  note_commit(*outcome);
}

// All that is applied, durable before this returns.
void Mapper::Impl::commit() {
  std::uint64_t asked = 0;
  {
    const std::lock_guard lock(mutex);
    asked = commits_asked;
  }
  finish_commit();
  begin_commit();
  finish_commit();
  const std::lock_guard lock(mutex);
  commits_done = asked;
  changed.notify_all();
}

void Mapper::Impl::note_commit(const Status& outcome) {
  if (!outcome.ok() && !commits_fail) spdlog::error("commits fail: {}", outcome.to_string());
  if (outcome.ok() && commits_fail) spdlog::info("commits go through again");
  commits_fail = !outcome.ok();
  const std::lock_guard lock(mutex);
  if (!failed) storage = outcome;
  changed.notify_all();
}

void Mapper::Impl::start_idle_work() {
  {
    const std::lock_guard lock(mutex);
    if (failed || !relaxation_pending || idle_requested || stopping || !durable.empty()) return;
    idle_requested = true;
  }
  const Status submitted =
      writer->submit(storage::IdleWorkRecord{options.idle_slice}, [this](const Result<std::uint64_t>& result) {
        if (result.ok()) return;
        const std::lock_guard lock(mutex);
        idle_requested = false;
      });
  if (submitted.ok()) return;
  const std::lock_guard lock(mutex);
  idle_requested = false;
}

// The next chunk to go of those sessions that are being deleted; nullopt: none, or not now.
std::optional<storage::RemoveChunkRecord> Mapper::Impl::next_removal() {
  // What it edits cannot leave memory while commits fail.
  if (commits_fail || budget->used(storage::Share::kDirty) > budget->allowance(storage::Share::kDirty))
    return std::nullopt;
  const std::lock_guard lock(mutex);
  while (!failed && !shutting_down && !going.empty()) {
    const SessionNumber session = *going.begin();
    if (const auto next = next_deletion(*map->session(session))) {
      // Frames that wait for their lookup are soon through.
      return lookups.is_waiting(session) ? std::nullopt : next;
    }
    spdlog::info("session {} is deleted", session);
    going.erase(session);
    changed.notify_all();
  }
  return std::nullopt;
}

// Keyframes go first: one chunk at a time, when nothing else waits.
void Mapper::Impl::start_deletion() {
  {
    const std::lock_guard lock(mutex);
    if (deletion_requested || stopping || !durable.empty()) return;
  }
  const auto removal = next_removal();
  if (!removal) return;
  {
    const std::lock_guard lock(mutex);
    deletion_requested = true;
  }
  const auto done = [this](const Result<std::uint64_t>& result) {
    if (result.ok()) return;
    const std::lock_guard lock(mutex);
    deletion_requested = false;
  };
  if (!writer->submit(*removal, done).ok()) done(Status(Reason::BUDGET_EXCEEDED, "the queue is full"));
}

void Mapper::Impl::begin_deletion(const storage::Session& session) {
  if (!storage::is_going(session)) return;
  doubts.forget(session.number);
  if (places) places->leave_out(session.number);
  const std::lock_guard lock(mutex);
  lookups.forget_failed(session.number);
  if (session.frames > 0) going.insert(session.number);
}

std::vector<storage::JournalRecord> Mapper::Impl::look_up_one(FrameId frame) {
  const auto view = map->view();
  Lookup found;
  Status trouble;
  const auto session = view->session(frame.session);
  if (!session || storage::is_going(*session)) return {};  // nobody will recognise it
  try {
    found = look_up(*view, *places, pictures, frame);
  } catch (const StatusError& error) {
    trouble = error.status();
  }
  if (const auto cold = view->cold(frame); !cold->words.empty()) add_place(frame, cold->words);  // as at a start
  if (!trouble.ok()) throw StatusError(trouble);
  count_doubts(frame.session, found);
  return std::move(found.records);
}

void Mapper::Impl::count_doubts(SessionNumber session, const Lookup& found) {
  if (found.contradiction) {
    const auto doubt = doubts.contradict(session, found.contradiction->with, found.contradiction->what.message());
    if (doubt) spdlog::warn("the calibration of session {} is in doubt: {}", doubt->session, doubt->message);
    return;
  }
  for (const storage::JournalRecord& record : found.records)
    if (const auto* proposal = std::get_if<storage::ClosureProposalRecord>(&record))
      doubts.confirm(session, proposal->match.session);
}

// Until it is durable: only then is the lookup done. Keyframes from robots may fill the queue, and the disk may take
// nothing for a while; a proposal waits its turn.
bool Mapper::Impl::journal_patiently(const storage::JournalRecord& record) {
  for (;;) {
    auto durable_at = std::make_shared<std::promise<bool>>();
    auto written = durable_at->get_future();
    const Status submitted = writer->submit(
        record, [durable_at](const Result<std::uint64_t>& result) { durable_at->set_value(result.ok()); });
    if (submitted.ok() && written.get()) return true;
    if (failed || submitted.reason() == Reason::SHUTTING_DOWN) return false;
    std::unique_lock lock(mutex);
    const auto pause = submitted.reason() == Reason::BUDGET_EXCEEDED ? kQueueFull : kDiskFails;
    if (changed.wait_for(lock, pause, [this] { return shutting_down; })) return false;
  }
}

bool Mapper::Impl::all_done_locked() const {
  return writer->idle() && durable.empty() && !applying && applied == writer->durable_through() &&
         lookups.waiting() == 0 && !relaxation_pending && !idle_requested && going.empty();
}

Status Mapper::Impl::stop() {
  if (stopped) return storage;
  stopped = true;
  {
    const std::lock_guard lock(sessions_mutex);
    for (const auto& [uuid, session] : sessions) budget->release(storage::Share::kSessions, bytes_of(session));
  }
  if (!writer) return storage;  // never started
  {
    const std::lock_guard lock(mutex);
    shutting_down = true;
    changed.notify_all();
  }
  lookups.stop();
  writer->stop();
  {
    const std::lock_guard lock(mutex);
    stopping = true;
    changed.notify_all();
  }
  worker.join();
  if (places)
    if (const Status saved = places->save(); !saved.ok())
      spdlog::warn("the next start reads more of the map for its place index: {}", saved.to_string());
  return storage;
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
  } catch (const StatusError& error) {
    return error.status();
  }
  impl->start();
  return std::unique_ptr<Mapper>(new Mapper(std::move(impl)));
}

Result<SessionNumber> Mapper::begin_session(const SessionHeader& header) {
  const std::lock_guard lock(impl_->sessions_mutex);  // held through: one number for a uuid
  const auto known = impl_->sessions.find(header.uuid);
  if (known != impl_->sessions.end()) {
    const SessionHeader& begun = known->second.header;
    if (const auto now = view()->session(known->second.number); now && storage::is_going(*now))
      return Status(Reason::SESSION_DELETED,
                    "session " + known->second.display_name + " is deleted; begin a new session");
    if (same_camera(begun, header)) return known->second.number;
    return Status(Reason::CALIBRATION_CHANGED,
                  "session " + known->second.display_name + " began with another camera or flags; begin a new session");
  }
  if (impl_->failed) return stats().storage;
  std::size_t namesakes = 0;
  for (const auto& [uuid, other] : impl_->sessions)
    namesakes += other.header.robot == header.robot && other.header.name == header.name;
  storage::Session session;
  session.header = header;
  const std::size_t bytes = bytes_of(session);
  if (!budget().try_charge(storage::Share::kSessions, bytes))
    return {Reason::BUDGET_EXCEEDED,
            "the map has " + std::to_string(impl_->sessions.size()) + " sessions, as many as its memory budget allows"};
  const auto refused = [&](Status why) {
    budget().release(storage::Share::kSessions, bytes);
    return why;
  };
  // A number may be known from the journal though the engine's count, damaged, has gone back behind it.
  const auto taken = [&](SessionNumber number) {
    return std::any_of(impl_->sessions.begin(), impl_->sessions.end(),
                       [&](const auto& entry) { return entry.second.number == number; });
  };
  auto number = impl_->engine->allocate_session(impl_->epoch);
  while (number.ok() && taken(*number)) number = impl_->engine->allocate_session(impl_->epoch);
  if (!number.ok()) return refused(number.status());
  session.number = *number;
  session.display_name = namesakes == 0 ? header.name : header.name + '#' + std::to_string(namesakes + 1);
  auto journalled = submit_and_wait(storage::SessionRecord{session.number, session.display_name, header});
  if (!journalled.ok()) return refused(journalled.status());
  impl_->sessions.emplace(header.uuid, session);
  return session.number;
}

Status Mapper::submit(storage::JournalRecord record, Done done) {
  if (impl_->failed) return stats().storage;
  // While commits fail, what is dirty cannot leave memory: no more is taken in than fits.
  if (budget().used(storage::Share::kDirty) > budget().allowance(storage::Share::kDirty))
    if (Status storage = stats().storage; !storage.ok()) return storage;
  // The queue is the lookups' too; what they find must still fit in.
  if (std::holds_alternative<storage::KeyframeRecord>(record) && impl_->lookups.is_full())
    return {Reason::BUDGET_EXCEEDED, "place recognition is too far behind"};
  return impl_->writer->submit(std::move(record), std::move(done));
}

Result<std::uint64_t> Mapper::submit_and_wait(storage::JournalRecord record) {
  auto promise = std::make_shared<std::promise<Result<std::uint64_t>>>();
  auto future = promise->get_future();
  const Status submitted =
      submit(std::move(record), [promise](const Result<std::uint64_t>& result) { promise->set_value(result); });
  if (!submitted.ok()) return submitted;
  return future.get();
}

Status Mapper::wait_applied(std::uint64_t sequence, Clock::time_point deadline) const {
  std::unique_lock lock(impl_->mutex);
  if (impl_->changed.wait_until(lock, deadline, [&] { return impl_->applied >= sequence; })) return {};
  return {Reason::DEADLINE, "journal record " + std::to_string(sequence) + " is durable but not applied yet"};
}

std::optional<std::vector<EdgeChange>> Mapper::edge_changes(std::uint64_t sequence) const {
  const std::lock_guard lock(impl_->mutex);
  for (const auto& [of, changes] : impl_->edge_changes)
    if (of == sequence) return changes;
  return std::nullopt;
}

Status Mapper::wait_idle(Clock::time_point deadline) const {
  std::unique_lock lock(impl_->mutex);
  while (!impl_->all_done_locked()) {
    if (impl_->failed) return impl_->storage;
    if (Clock::now() >= deadline) return {Reason::DEADLINE, "the map is still being worked on"};
    impl_->changed.wait_for(lock, std::chrono::milliseconds(20));
  }
  return {};
}

Result<std::uint64_t> Mapper::commit(Clock::time_point deadline) {
  std::unique_lock lock(impl_->mutex);
  const std::uint64_t mine = ++impl_->commits_asked;
  impl_->changed.notify_all();
  if (!impl_->changed.wait_until(lock, deadline, [&] { return impl_->commits_done >= mine; }))
    return Status(Reason::DEADLINE, "the commit has not come about yet");
  if (!impl_->storage.ok()) return impl_->storage;
  return impl_->engine->applied_sequence();
}

void Mapper::watch_closures(ClosureWatcher watcher) {
  const std::lock_guard lock(impl_->watcher_mutex);
  impl_->closure_watcher = std::move(watcher);
}

void Mapper::watch_edits(storage::Map::EditWatcher watcher) {
  std::uint64_t told = 0;
  {
    const std::lock_guard lock(impl_->watcher_mutex);
    impl_->edit_watcher = std::move(watcher);
    impl_->edits_watched = true;
    told = impl_->edits_told;
    const std::vector<storage::ChunkId> untold(impl_->edits_untold.begin(), impl_->edits_untold.end());
    impl_->edits_untold.clear();
    if (impl_->edit_watcher && !untold.empty()) impl_->edit_watcher(told, untold);
  }
  // What was told to nobody is in the view that the caller takes next: the worker shows it right after.
  std::unique_lock lock(impl_->mutex);
  while (view()->version() < told && !impl_->failed) impl_->changed.wait_for(lock, std::chrono::milliseconds(1));
}

std::shared_ptr<const storage::MapView> Mapper::view() const { return impl_->map->view(); }
const MapIdentity& Mapper::identity() const { return impl_->identity; }
const place::PlaceIndex& Mapper::places() const { return *impl_->places; }
const place::Vocabulary& Mapper::vocabulary() const { return *impl_->vocabulary; }
storage::Budget& Mapper::budget() const { return *impl_->budget; }
storage::Engine& Mapper::engine() const { return *impl_->engine; }

MapperStats Mapper::stats() const {
  MapperStats stats;
  stats.durable_sequence = impl_->writer->durable_through();
  stats.places = impl_->places ? impl_->places->size() : 0;
  stats.doubts = impl_->doubts.doubts();
  stats.places_left_out = impl_->places ? impl_->places->left_out() : 0;
  stats.pending_frames = impl_->map->view()->pending_frames();
  const Status journal = impl_->writer->health();
  const std::lock_guard lock(impl_->mutex);
  stats.applied_sequence = impl_->applied;
  stats.queued = impl_->durable.size();
  stats.lookup_lag = impl_->lookups.waiting();
  stats.rba_p50_us = impl_->timings.quantile(0.5);
  stats.rba_p99_us = impl_->timings.quantile(0.99);
  stats.rba_max_us = impl_->timings.quantile(1);
  stats.rba_solves = impl_->relaxations;
  stats.active_frames_mean =
      impl_->relaxations == 0 ? 0 : static_cast<double>(impl_->active_frames) / static_cast<double>(impl_->relaxations);
  stats.storage = journal.ok() || impl_->failed ? impl_->storage : journal;
  return stats;
}

Status Mapper::stop() { return impl_->stop(); }

}  // namespace relmap::map
