// How edits become visible: frozen copies of the chunks touched, a new table, one pointer swap. Where possible they are
// made in the memory of versions that nobody reads any more.
#include "proto/base/mutex.h"
#include "storage/graph/precision.h"
#include "storage/map/map_impl.h"

namespace relmap::storage {
namespace {

void round(FrameHot& frame) { round_estimates(frame); }
template <typename Frame>
void round(Frame&) {}

// Shows the fresh copies of a part from version `next` on, and accounts for them and for those they replace.
template <typename Frame>
void freeze(WorkingPart<Frame>& part, Slots<Frame>& slots, std::uint64_t next, ViewLedger& ledger,
            std::size_t& dirty_bytes) {
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
    if (part.is_fresh(slot)) {
      if (part.bytes[slot] > 0) ledger.retire(part.since[slot], next, part.bytes[slot]);
      round(*part.frames[slot]);
      dirty_bytes -= part.bytes[slot];
      part.bytes[slot] = memory_bytes(*part.frames[slot]);
      dirty_bytes += part.bytes[slot];
      part.since[slot] = next;
      slots[slot] = part.frames[slot];
    }
  }
  part.fresh = 0;
}

// A spare, with whatever it still holds, or a new one.
template <typename Table>
std::shared_ptr<Table> fresh(Spares<Table>& spares) {
  std::shared_ptr<Table> table = spares.take();
  return table ? table : std::make_shared<Table>();
}

}  // namespace

WorkingChunk& Map::Impl::touch(ChunkId id) {
  const auto [at, fresh] = dirty.try_emplace(id);
  WorkingChunk& chunk = at->second;
  if (fresh) {
    budget->charge(Share::kDirty, kEmptyChunk);
    dirty_bytes += kEmptyChunk;
  }
  if (!chunk.touched) {
    chunk.touched = true;
    touched.push_back(id);
  }
  return chunk;
}

std::shared_ptr<const MapView> Map::Impl::publish() noexcept {
  if (budget->used(Share::kCache) > budget->allowance(Share::kCache)) {  // these may keep evicted parts alive
    recent_hot.clear();
    recent_warm.clear();
  }
  if (!touched.empty()) {
    std::size_t bytes = dirty_bytes;
    std::shared_ptr<DirtyTable> table = fresh(spare_tables);
    *table = *published_dirty;
    hot_edits.clear();
    for (const ChunkId id : touched) {
      WorkingChunk& chunk = dirty.at(id);
      if (chunk.hot.fresh != 0 || chunk.removed) hot_edits.push_back(id);
      auto at = std::lower_bound(table->begin(), table->end(), id,
                                 [](const auto& entry, const ChunkId& key) { return entry.first < key; });
      if (at == table->end() || at->first != id) at = table->insert(at, {id, nullptr});
      std::shared_ptr<DirtyChunk> frozen = fresh(spare_chunks);
      if (at->second) {
        *frozen = *at->second;
        spare_chunks.put(std::const_pointer_cast<DirtyChunk>(at->second));
      }
      if (!at->second || chunk.removed) *frozen = {};
      frozen->removed = chunk.removed;
      freeze(chunk.hot, frozen->hot, version + 1, *ledger, bytes);
      freeze(chunk.warm, frozen->warm, version + 1, *ledger, bytes);
      freeze(chunk.cold, frozen->cold, version + 1, *ledger, bytes);
      at->second = std::move(frozen);
      chunk.touched = false;
    }
    touched.clear();
    if (edit_watcher && !hot_edits.empty()) edit_watcher(version + 1, hot_edits);
    spare_tables.put(std::const_pointer_cast<DirtyTable>(published_dirty));
    published_dirty = std::move(table);
    if (bytes > dirty_bytes)
      budget->charge(Share::kDirty, bytes - dirty_bytes);
    else
      budget->release(Share::kDirty, dirty_bytes - bytes);
    dirty_bytes = bytes;
  }
  if (!fresh_sessions.empty()) {
    for (const SessionNumber number : fresh_sessions) session_counts.add(*find_session(sessions, number));
    fresh_sessions.clear();
    publish_sessions();
  }
  if (labels_touched) {
    published_labels = std::make_shared<const LabelChanges>(labels);
    labels_touched = false;
  }
  charge_rest();
  if (skipped_touched) {
    published_skipped = std::make_shared<const SkippedTable>(skipped);
    skipped_touched = false;
  }
  return show();
}

std::shared_ptr<const MapView> Map::Impl::show() {
  Shown next = std::exchange(spare_view, {});
  if (!next.view) {
    auto parts = std::make_unique<MapView::Impl>();
    next.parts = parts.get();
    next.view = std::make_shared<const MapView>(std::move(parts));
  }
  MapView::Impl& parts = *next.parts;
  parts.version = ++version;
  parts.cache = cache;
  parts.snapshot = snapshot;
  parts.digests_hold = digests_hold;
  parts.dirty = published_dirty;
  parts.sessions = published_sessions;
  parts.session_counts = session_counts;
  parts.labels = published_labels;
  parts.skipped = published_skipped;
  parts.state = state;
  parts.pending_frames = state.pending.size();
  ledger->add(version);
  parts.ledger = ledger;
  std::shared_ptr<const MapView> view = next.view;
  {
    const MutexLock lock(view_mutex);
    std::swap(shown, next);
  }
  if (only_ours(next.view)) {  // otherwise it ends with its last reader
    next.parts->let_go();
    spare_view = std::move(next);
  }
  // Cleared, so that what they showed can become a spare itself.
  spare_tables.for_each_free([](DirtyTable& table) { table.clear(); });
  spare_chunks.for_each_free([](DirtyChunk& chunk) { chunk = {}; });
  return view;
}

void Map::Impl::publish_sessions() {
  published_sessions = std::make_shared<const SessionTable>(sessions);
  std::size_t bytes = 0;
  for (const auto& session : sessions) bytes += 2 * memory_bytes(*session);  // also as the worker edits it
  budget->release(Share::kSessions, session_bytes);
  budget->charge(Share::kSessions, bytes);
  session_bytes = bytes;
}

void Map::Impl::charge_events() {
  const std::size_t bytes = events.memory_bytes();
  if (bytes > event_bytes)
    budget->charge(Share::kDirty, bytes - event_bytes);
  else
    budget->release(Share::kDirty, event_bytes - bytes);
  dirty_bytes += bytes - event_bytes;
  event_bytes = bytes;
}

void Map::Impl::charge_rest() {
  const auto charge = [this](Share share, std::size_t& charged, std::size_t bytes) {
    if (bytes == charged) return;
    budget->release(share, charged);
    budget->charge(share, bytes);
    charged = bytes;
  };
  charge(Share::kSessions, pending_bytes, state.pending.memory_bytes());
  charge(Share::kDirty, spare_bytes, spare_hot.bytes());
}

}  // namespace relmap::storage
