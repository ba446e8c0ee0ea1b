// How edits become visible: frozen copies of the chunks touched, a new table, one pointer swap.
#include "storage/map_impl.h"
#include "storage/precision.h"

namespace relmap {
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

std::shared_ptr<const MapView> Map::Impl::publish() {
  if (budget->used(Share::kCache) > budget->allowance(Share::kCache)) {  // what was evicted may live on in these
    recent_hot.clear();
    recent_warm.clear();
  }
  if (!touched.empty()) {
    std::size_t bytes = dirty_bytes;
    auto table = std::make_shared<DirtyTable>(*published_dirty);
    for (const ChunkId id : touched) {
      WorkingChunk& chunk = dirty.at(id);
      auto at = std::lower_bound(table->begin(), table->end(), id,
                                 [](const auto& entry, const ChunkId& key) { return entry.first < key; });
      if (at == table->end() || at->first != id) at = table->insert(at, {id, std::make_shared<const DirtyChunk>()});
      auto frozen = std::make_shared<DirtyChunk>(*at->second);
      freeze(chunk.hot, frozen->hot, version + 1, *ledger, bytes);
      freeze(chunk.warm, frozen->warm, version + 1, *ledger, bytes);
      freeze(chunk.cold, frozen->cold, version + 1, *ledger, bytes);
      at->second = std::move(frozen);
      chunk.touched = false;
    }
    touched.clear();
    published_dirty = std::move(table);
    if (bytes > dirty_bytes)
      budget->charge(Share::kDirty, bytes - dirty_bytes);
    else
      budget->release(Share::kDirty, dirty_bytes - bytes);
    dirty_bytes = bytes;
  }
  if (!fresh_sessions.empty()) {
    published_sessions = std::make_shared<const SessionTable>(sessions);
    fresh_sessions.clear();
  }
  if (labels_touched) {
    published_labels = std::make_shared<const LabelChanges>(labels);
    labels_touched = false;
  }
  if (const std::size_t bytes = state.pending.memory_bytes(); bytes != pending_bytes) {
    budget->release(Share::kSessions, pending_bytes);
    budget->charge(Share::kSessions, bytes);
    pending_bytes = bytes;
  }
  if (settled_touched) {
    published_settled = std::make_shared<const SettledTable>(settled);
    settled_touched = false;
  }
  return show();
}

std::shared_ptr<const MapView> Map::Impl::show() {
  auto parts = std::make_unique<MapView::Impl>();
  parts->version = ++version;
  parts->cache = cache;
  parts->ledger = ledger;
  parts->snapshot = snapshot;
  parts->dirty = published_dirty;
  parts->sessions = published_sessions;
  parts->labels = published_labels;
  parts->settled = published_settled;
  parts->state = state;
  parts->pending_frames = state.pending.size();
  std::shared_ptr<const MapView> shown = std::make_shared<const MapView>(std::move(parts));
  {
    const std::lock_guard lock(view_mutex);
    view.swap(shown);  // the former may end with this call, outside the lock
    return view;
  }
}

}  // namespace relmap
