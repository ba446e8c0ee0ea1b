// What a Map is made of. Private to storage.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <span>
#include <unordered_map>
#include <vector>

#include "storage/map_view_impl.h"
#include "storage/working_chunk.h"

namespace relmap {

// The chunks the worker read last, so that a search over clean frames does not take the shared cache's lock for each.
// Good until the next commit; holds a few chunks beyond their eviction at most.
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

struct Map::Impl {
  std::shared_ptr<Engine> engine;
  std::uint64_t epoch = 0;
  std::shared_ptr<Budget> budget;
  std::shared_ptr<ChunkCache> cache;
  std::shared_ptr<ViewLedger> ledger;
  std::shared_ptr<const EngineSnapshot> snapshot;  // of the last commit

  // The worker's state: what the next publish() shows.
  std::map<ChunkId, WorkingChunk> dirty;
  std::vector<ChunkId> touched;  // since the last publish
  SessionTable sessions;
  std::set<SessionNumber> fresh_sessions;  // cloned since the last publish
  std::set<SessionNumber> dirty_sessions;  // since the last commit
  std::map<SessionNumber, Session> committed_sessions;
  LabelChanges labels;
  bool labels_touched = false;
  MapState state;
  std::size_t dirty_bytes = 0;
  RecentChunks<FrameHot> recent_hot;
  RecentChunks<FrameWarm> recent_warm;

  // What the last publish() showed.
  std::uint64_t version = 0;
  std::shared_ptr<const DirtyTable> published_dirty = std::make_shared<DirtyTable>();
  std::shared_ptr<const SessionTable> published_sessions;
  std::shared_ptr<const LabelChanges> published_labels = std::make_shared<LabelChanges>();
  mutable std::mutex view_mutex;
  std::shared_ptr<const MapView> view;

  const WorkingChunk* find(ChunkId id) const {
    const auto it = dirty.find(id);
    return it == dirty.end() ? nullptr : &it->second;
  }
  WorkingChunk& touch(ChunkId id);
  Session& edit_session(SessionNumber number);
  std::shared_ptr<const MapView> publish();
  std::shared_ptr<const MapView> show();  // a new version of what is published

  // Puts and deletes of a commit, chunk by chunk (map_commit.cc).
  struct Batch;
  void write_chunk(Batch& batch, ChunkId id);
  void write_chunks(Batch& batch, std::span<const ChunkId> chunks);
  void write_rest(Batch& batch);
  Status commit();
  void settle(Batch& batch);  // after the engine has taken it
};

}  // namespace relmap
