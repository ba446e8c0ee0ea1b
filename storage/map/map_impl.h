// What a Map is made of. Private to storage.
#pragma once

#include <future>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "proto/base/mutex.h"
#include "storage/events/event_writer.h"
#include "storage/map/map_view_impl.h"
#include "storage/map/session_records.h"
#include "storage/map/working_chunk.h"
#include "storage/memory/spares.h"

namespace relmap::storage {

// The chunks that the worker read last, so that a search over clean frames does not take the shared cache's lock for
// each frame. Valid until the next commit. A few chunks may stay here after they have been evicted.
template <typename Frame>
class RecentChunks {
 public:
  std::shared_ptr<const Frame> get(ChunkCache& cache, const EngineSnapshot& snapshot, FrameId id) {
    auto& part = recent_[std::hash<ChunkId>()(chunk_id(id)) % recent_.size()];
    if (!part.second || part.first != chunk_id(id)) part = {chunk_id(id), cache.part<Frame>(snapshot, chunk_id(id))};
    return cache.frame(*part.second, slot_of(id));
  }
  void clear() { recent_ = {}; }

 private:
  std::array<std::pair<ChunkId, std::shared_ptr<const PackedPart<Frame>>>, 8> recent_;
};

// Bytes of a dirty chunk without frames: the worker's copy, and the published one.
inline constexpr std::size_t kEmptyChunk = sizeof(WorkingChunk) + sizeof(DirtyChunk);

// A commit ought to begin when more sessions than this have been edited, so that their table stays short.
inline constexpr std::size_t kEditedSessions = 4096;

using WorkingChunks = std::map<ChunkId, WorkingChunk>;
inline const WorkingChunk* find_chunk(const WorkingChunks& chunks, ChunkId id) {
  const auto at = chunks.find(id);
  return at == chunks.end() ? nullptr : &at->second;
}

struct Map::Impl {
  std::shared_ptr<Engine> engine;
  std::uint64_t epoch = 0;
  std::shared_ptr<Budget> budget;
  std::shared_ptr<ChunkCache> cache;
  std::shared_ptr<ViewLedger> ledger;
  std::shared_ptr<const EngineSnapshot> snapshot;  // of the last commit

  // The worker's state: what the next publish() shows.
  WorkingChunks dirty;           // since the last commit was begun
  std::vector<ChunkId> touched;  // since the last publish
  EditWatcher edit_watcher;
  std::vector<ChunkId> hot_edits;          // what edit_watcher is told next
  SessionTable sessions;                   // those that are dirty, or that a commit is writing
  std::set<SessionNumber> fresh_sessions;  // cloned since the last publish
  std::set<SessionNumber> dirty_sessions;  // since the last commit was begun
  SessionCounts session_counts;            // of all that are not fresh, as they are; of those, without them
  std::size_t session_bytes = 0;           // charged for `sessions`
  LabelChanges labels;                     // changes to the snapshot, including those that a commit is writing
  bool labels_touched = false;
  SkippedTable skipped;  // likewise
  bool skipped_touched = false;
  std::map<std::uint64_t, EditKey> edits;
  std::set<std::uint64_t> changed_edits;  // remembered or forgotten since the last commit was begun
  MapState state;
  bool digests_hold = false;  // the digests in the snapshot are right, and commits keep them so
  EventWriter events{{}};
  std::size_t event_bytes = 0;    // part of dirty_bytes: what the next commit tells
  std::size_t dirty_bytes = 0;    // charged, including what a commit is writing
  std::size_t pending_bytes = 0;  // charged for state.pending
  RecentChunks<FrameHot> recent_hot;
  RecentChunks<FrameWarm> recent_warm;

  // A commit under way, which the engine writes in a thread of its own. What it writes is read here until the engine
  // has it.
  struct Batch;
  struct Commit {
    WorkingChunks chunks;
    std::size_t bytes = 0;        // part of dirty_bytes
    std::size_t event_bytes = 0;  // part of `bytes`
    SessionTable sessions;
    LabelChanges labels;
    SkippedTable skipped;
    std::set<ChunkId> pending;
    std::set<std::uint64_t> edits;
    std::shared_ptr<Batch> batch;
    std::size_t cache_bytes = 0;  // charged to the cache's share for the batch
    std::future<Status> written;  // not valid if there was no memory to begin
  };
  std::unique_ptr<Commit> committing;

  // Memory for the next copies: the same frame is edited many times in a row, and so are the tables that show it.
  static constexpr std::size_t kSpareFrames = 128, kSpareTables = 8;
  Spares<FrameHot> spare_hot{kSpareFrames};
  Spares<DirtyChunk> spare_chunks{kSpareTables};
  Spares<DirtyTable> spare_tables{kSpareTables};
  std::size_t spare_bytes = 0;  // charged for spare_hot

  // What the last publish() showed.
  std::uint64_t version = 0;
  std::shared_ptr<const DirtyTable> published_dirty = std::make_shared<DirtyTable>();
  std::shared_ptr<const SessionTable> published_sessions;
  std::shared_ptr<const LabelChanges> published_labels = std::make_shared<LabelChanges>();
  std::shared_ptr<const SkippedTable> published_skipped = std::make_shared<SkippedTable>();
  struct Shown {
    std::shared_ptr<const MapView> view;
    MapView::Impl* parts = nullptr;  // of `view`
  };
  mutable Mutex view_mutex;
  Shown shown RELMAP_GUARDED_BY(view_mutex);
  Shown spare_view;  // one that was released, to be used again

  const WorkingChunk* find(ChunkId id) const { return find_chunk(dirty, id); }
  const WorkingChunk* find_writing(ChunkId id) const {
    return committing ? find_chunk(committing->chunks, id) : nullptr;
  }
  // The part of a frame if it is edited or being written, null if its chunk was removed; nullopt: the snapshot's is
  // current.
  template <typename Frame>
  std::optional<std::shared_ptr<const Frame>> unwritten(FrameId id) const {
    for (const WorkingChunk* chunk : {find(chunk_id(id)), find_writing(chunk_id(id))}) {
      if (chunk && chunk->part<Frame>().frames[slot_of(id)]) return chunk->part<Frame>().frames[slot_of(id)];
      if (chunk && chunk->removed) return nullptr;
    }
    return std::nullopt;
  }
  WorkingChunk& touch(ChunkId id);
  void remove_chunk(ChunkId id);
  // As the worker sees it; null if there is none.
  std::shared_ptr<const Session> session(SessionNumber number) const;
  Session& edit_session(SessionNumber number);
  void set_skipped(const SkippedTable::key_type& key, std::optional<Skipped> value);
  void publish_sessions();
  // Where memory runs out, this, complete() and restore() end the process, which loses nothing: half of what they do
  // would be a map that differs from its journal.
  std::shared_ptr<const MapView> publish() noexcept;
  std::shared_ptr<const MapView> show();  // a new version of what is published
  void charge_rest();
  void charge_events();

  // Puts and deletes of a commit, chunk by chunk (map_commit.cc).
  std::shared_ptr<const Session> last_committed(SessionNumber number) const;
  void write_chunk(Batch& batch, ChunkId id);
  void write_digests(Batch& batch, ChunkId id, bool existed, const WorkingChunk& chunk);
  void write_removal(Batch& batch, ChunkId id);
  void write_chunks(Batch& batch, std::span<const ChunkId> chunks);
  void write_all(Batch& batch);
  void write_rest(Batch& batch);
  Status begin_commit(std::function<void()> written);
  std::optional<Status> finish_commit();
  Status make_digests(const DigestProgress& progress, bool go_on);
  void complete(Commit& commit) noexcept;  // the engine has it
  void restore(Commit& commit) noexcept;   // it failed: what it held is dirty again
};

}  // namespace relmap::storage
