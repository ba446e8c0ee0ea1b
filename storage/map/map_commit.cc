// How edits become durable: one atomic batch of the parts that are dirty.
//
// Hot and warm parts of a session's last chunk, which is open, are written frame by frame, as they change; when a frame
// of a later chunk has come, they are gathered into one value a part. Cold parts and words never change: they are
// written once, frame by frame.
#include <algorithm>
#include <future>
#include <iterator>
#include <span>
#include <type_traits>

#include "proto/base/clock.h"
#include "storage/format/chunk_codec.h"
#include "storage/format/frame_codec.h"
#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "storage/map/digest_records.h"
#include "storage/map/map_impl.h"
#include "storage/map/pending_frames.h"

namespace relmap::storage {

namespace {

constexpr std::size_t kWorthAThread = std::size_t{1} << 20;  // bytes of dirty frames

}  // namespace

struct Map::Impl::Batch {
  std::uint64_t number = 0;  // of the commit
  std::vector<Put> puts;
  std::vector<std::string> deletes;
  Status trimmed;  // the outcome of trimming the journal afterwards

  // What is written of a part. `whole`: its puts are all there is; otherwise other frames stay as they are.
  template <typename Frame>
  struct Part {
    ChunkId id;
    bool whole = false;
    std::size_t first = 0, last = 0;                                    // its puts: from first up to last
    std::array<std::shared_ptr<const Frame>, kFramesPerChunk> decoded;  // its frames, where they are decoded

    Part after(std::size_t count) && {
      first += count;
      last += count;
      return std::move(*this);
    }
  };
  std::vector<Part<FrameHot>> hot;
  std::vector<Part<FrameWarm>> warm;
  std::vector<std::pair<ChunkId, std::size_t>> digests;  // ascending: where their puts are

  // The record of the chunk's digests that this commit writes; nullptr if it writes none.
  const Bytes* find_digests(ChunkId id) const {
    const auto at = std::lower_bound(digests.begin(), digests.end(), std::pair(id, std::size_t{0}));
    return at != digests.end() && at->first == id ? &puts[at->second].value : nullptr;
  }

  void put(std::string key, Bytes value) { puts.push_back({std::move(key), std::move(value)}); }

  void append(Batch&& other) {
    for (auto& part : other.hot) hot.push_back(std::move(part).after(puts.size()));
    for (auto& part : other.warm) warm.push_back(std::move(part).after(puts.size()));
    for (const auto& [id, put] : other.digests) digests.emplace_back(id, puts.size() + put);
    std::move(other.puts.begin(), other.puts.end(), std::back_inserter(puts));
    std::move(other.deletes.begin(), other.deletes.end(), std::back_inserter(deletes));
  }

  template <typename Frame>
  void add(Part<Frame> part) {
    if constexpr (std::is_same_v<Frame, FrameHot>)
      hot.push_back(std::move(part));
    else
      warm.push_back(std::move(part));
  }
};

namespace {

void encode(ByteWriter& w, FrameId id, const FrameHot& frame) { encode_hot(w, id, frame); }
void encode(ByteWriter& w, FrameId id, const FrameWarm& frame) { encode_warm(w, id, frame); }

template <typename Body>
Bytes single(Part part, FrameId id, std::uint64_t commit, Body body) {
  ByteWriter w;
  body(w);
  return frame_container(part, id, commit, w.bytes());
}

template <typename Frame>
bool any(const std::array<std::shared_ptr<Frame>, kFramesPerChunk>& frames) {
  return std::any_of(frames.begin(), frames.end(), [](const auto& frame) { return frame != nullptr; });
}

// Writes the dirty frames of a part, one put each.
template <typename Frame, typename Batch>
void write_frames(Batch& batch, ChunkId id, bool chunk_is_new, const WorkingPart<Frame>& dirty) {
  if (!any(dirty.frames)) return;
  typename Batch::template Part<Frame> part{id, chunk_is_new, batch.puts.size(), 0, {}};
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
    if (!dirty.frames[slot]) continue;
    const FrameId frame = frame_in(id, slot);
    batch.put(keys::frame(kPartOf<Frame>, frame), single(kPartOf<Frame>, frame, batch.number, [&](ByteWriter& w) {
                encode(w, frame, *dirty.frames[slot]);
              }));
    part.decoded[slot] = dirty.frames[slot];
  }
  part.last = batch.puts.size();
  batch.add(std::move(part));
}

// Writes a whole part: dirty frames, frames that the commit before is still writing, and the stored records of the
// others, damaged or not. Returns the frames that it has, one bit for each slot.
template <typename Frame, typename Batch>
std::uint64_t write_whole(Batch& batch, ChunkId id, const PackedPart<Frame>* committed,
                          const WorkingPart<Frame>& before, const WorkingPart<Frame>& dirty) {
  typename Batch::template Part<Frame> part{id, true, batch.puts.size(), batch.puts.size() + 1, {}};
  PartWriter writer(kPartOf<Frame>, id, batch.number);
  std::uint64_t frames = 0;
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
    if (const auto& frame = dirty.frames[slot] ? dirty.frames[slot] : before.frames[slot]) {
      ByteWriter w;
      encode(w, frame_in(id, slot), *frame);
      writer.add(slot, w.bytes());
      part.decoded[slot] = frame;
    } else if (committed) {
      const auto record = committed->record(slot);
      if (!record.owner) continue;
      writer.copy(slot, record.body, record.crc);
      part.decoded[slot] = record.frame;
    } else {
      continue;
    }
    frames |= std::uint64_t{1} << slot;
  }
  batch.put(keys::part(kPartOf<Frame>, id), writer.finish());
  batch.add(std::move(part));
  return frames;
}

}  // namespace

// The session as the engine has it once the commit under way is through.
std::shared_ptr<const Session> Map::Impl::last_committed(SessionNumber number) const {
  if (committing)
    if (auto writing = find_session(committing->sessions, number)) return writing;
  return cache->session(*snapshot, number);
}

void Map::Impl::write_removal(Batch& batch, ChunkId id) {
  batch.hot.push_back({id, true, batch.puts.size(), batch.puts.size(), {}});
  batch.warm.push_back({id, true, batch.puts.size(), batch.puts.size(), {}});
  batch.deletes.push_back(keys::part(Part::kHot, id));
  batch.deletes.push_back(keys::part(Part::kWarm, id));
  batch.deletes.push_back(keys::digests(id));
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
    for (const Part part : {Part::kHot, Part::kWarm, Part::kCold, Part::kWords})
      batch.deletes.push_back(keys::frame(part, frame_in(id, slot)));
}

// Writes the digests of a chunk of which hot frames are dirty: those of the others are copied from the record as the
// commit before leaves it.
void Map::Impl::write_digests(Batch& batch, ChunkId id, bool existed, const WorkingChunk& chunk) {
  if (!digests_hold || !any(chunk.hot.frames)) return;
  HotFrames edited;
  std::copy(chunk.hot.frames.begin(), chunk.hot.frames.end(), edited.begin());
  std::optional<Bytes> stored;
  const Bytes* record = committing ? committing->batch->find_digests(id) : nullptr;
  if (!record && existed) {
    stored = snapshot->get(keys::digests(id)).or_throw();
    if (stored) record = &*stored;
  }
  auto before = record ? unpack_digests(*record, id) : Result<PackedDigests>(PackedDigests{});
  if (existed && (!record || !before.ok())) {  // it is lost, and made anew
    before = PackedDigests{};
    const WorkingChunk* writing = find_writing(id);
    const HotFrames committed = readable_frames(*cache->part<FrameHot>(*snapshot, id));
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
      if (edited[slot]) continue;
      edited[slot] = writing && writing->hot.frames[slot] ? writing->hot.frames[slot] : committed[slot];
    }
  }
  if (auto written = digest_record(id, *before, edited)) {
    batch.digests.emplace_back(id, batch.puts.size());
    batch.put(keys::digests(id), *std::move(written));
  } else {
    batch.deletes.push_back(keys::digests(id));
  }
}

void Map::Impl::write_chunk(Batch& batch, ChunkId id) {
  static const WorkingChunk kClean;
  const WorkingChunk* edited = find(id);
  if (edited && edited->removed) return write_removal(batch, id);
  const WorkingChunk* under_way = find_writing(id);
  const WorkingChunk& chunk = edited ? *edited : kClean;
  const WorkingChunk& writing = under_way ? *under_way : kClean;

  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
    if (!chunk.cold.frames[slot]) continue;
    const FrameId frame = frame_in(id, slot);
    const FrameCold& cold = *chunk.cold.frames[slot];
    if (cold.appearance.empty() && cold.picture.empty()) continue;
    batch.put(keys::frame(Part::kCold, frame),
              single(Part::kCold, frame, batch.number, [&](ByteWriter& w) { encode_cold(w, cold); }));
    if (cold.appearance.empty()) continue;
    batch.put(keys::frame(Part::kWords, frame),
              single(Part::kWords, frame, batch.number, [&](ByteWriter& w) { encode_words(w, cold.words); }));
  }

  // Whether the chunk was open at the last commit, and whether it is now. A session that is being deleted has no open
  // chunk.
  const auto is_open = [&](const Session& session) {
    return !is_going(session) && id.chunk >= chunk_of({id.session, session.last});
  };
  const auto before = last_committed(id.session);
  const bool existed = before && before->frames > 0 && id.chunk <= chunk_of({id.session, before->last});
  const bool was_open = existed && is_open(*before);
  const bool open = is_open(*session(id.session));
  write_digests(batch, id, existed, chunk);
  if (open) {
    write_frames(batch, id, !existed, chunk.hot);
    write_frames(batch, id, !existed, chunk.warm);
    return;
  }
  std::uint64_t frames = 0;
  if (any(chunk.hot.frames) || was_open)
    frames |=
        write_whole(batch, id, existed ? cache->part<FrameHot>(*snapshot, id).get() : nullptr, writing.hot, chunk.hot);
  if (any(chunk.warm.frames) || was_open)
    frames |= write_whole(batch, id, existed ? cache->part<FrameWarm>(*snapshot, id).get() : nullptr, writing.warm,
                          chunk.warm);
  if (!was_open) return;
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
    if (!((frames >> slot) & 1)) continue;
    batch.deletes.push_back(keys::frame(Part::kHot, frame_in(id, slot)));
    batch.deletes.push_back(keys::frame(Part::kWarm, frame_in(id, slot)));
  }
}

void Map::Impl::write_chunks(Batch& batch, std::span<const ChunkId> chunks) {
  for (const ChunkId id : chunks) write_chunk(batch, id);
}

void Map::Impl::write_rest(Batch& batch) {
  for (const SessionNumber number : dirty_sessions)
    batch.puts.push_back({keys::session(number), encode_session(*find_session(sessions, number))});
  for (const auto& [entry, present] : labels) {
    if (present)
      batch.puts.push_back({keys::label(entry.first, entry.second), {}});
    else
      batch.deletes.push_back(keys::label(entry.first, entry.second));
  }
  for (const auto& [entry, item] : skipped) {
    std::string key = keys::skipped(entry.first, entry.second);
    if (item)
      batch.puts.push_back({std::move(key), encode_skipped(*item)});
    else
      batch.deletes.push_back(std::move(key));
  }
  for (const std::uint64_t sequence : changed_edits) {
    if (const auto edit = edits.find(sequence); edit != edits.end())
      batch.puts.push_back({keys::edit(sequence), encode_edit(edit->second)});
    else
      batch.deletes.push_back(keys::edit(sequence));
  }
  write_pending(state.pending, batch.puts, batch.deletes);
  state.digests_commit = digests_hold ? batch.number : 0;
  state.digests_made = {};
  batch.puts.push_back({keys::map_state(), encode_state(state)});
}

void Map::Impl::write_all(Batch& batch) {
  std::set<ChunkId> touched_chunks;
  for (const auto& [id, chunk] : dirty) touched_chunks.insert(id);
  for (const SessionNumber number : dirty_sessions) {  // an open chunk may have closed without being touched
    if (const auto before = last_committed(number)) touched_chunks.insert(chunk_id({number, before->last}));
  }
  // Encoding and compressing are most of the work of a large commit, so two threads share it.
  const std::vector<ChunkId> chunks(touched_chunks.begin(), touched_chunks.end());
  const std::size_t half = dirty_bytes < kWorthAThread ? chunks.size() : chunks.size() / 2;
  Batch second;
  second.number = batch.number;
  std::future<void> writing;
  if (half < chunks.size())
    writing = std::async(std::launch::async, [&] { write_chunks(second, std::span(chunks).subspan(half)); });
  write_chunks(batch, std::span(chunks).first(half));
  if (writing.valid()) writing.get();
  batch.append(std::move(second));
  write_rest(batch);
}

Status Map::Impl::begin_commit(std::function<void()> written) try {
  publish();
  auto batch = std::make_shared<Batch>();
  batch->number = snapshot->commit_number() + (committing ? 2 : 1);
  write_all(*batch);  // while the commit before, which it builds upon, is still being written
  if (const auto before = finish_commit(); before && !before->ok()) return *before;

  events.begin_commit(*snapshot, state.applied_sequence, now_us(), batch->puts, batch->deletes);
  auto commit = std::make_unique<Commit>();
  for (const SessionNumber number : dirty_sessions) commit->sessions.push_back(*place_of(sessions, number));
  commit->labels = labels;
  commit->skipped = skipped;
  commit->batch = batch;
  // From here on what is dirty is the commit's, and finish_commit() gives it back whatever fails.
  committing = std::move(commit);
  committing->chunks = std::exchange(dirty, {});
  committing->bytes = dirty_bytes;
  committing->event_bytes = std::exchange(event_bytes, 0);
  dirty_sessions.clear();
  committing->pending = state.pending.take_changes();
  committing->edits = std::exchange(changed_edits, {});
  // The encoded bytes and the engine's copy of them take memory from the cache, but no more than the cache holds:
  // charging more would refuse others memory that is needed for a moment only.
  std::size_t encoded = 0;
  for (const Put& put : batch->puts) encoded += put.key.size() + put.value.size();
  committing->cache_bytes = std::min(2 * encoded, budget->used(Share::kCache));
  budget->charge(Share::kCache, committing->cache_bytes);
  cache->evict();
  const auto write = [engine = engine, epoch = epoch, applied = state.applied_sequence, batch, written] {
    const auto caught = [](const auto& step) -> Status {
      try {
        return step();
      } catch (const std::exception&) {
        return caught_status();
      }
    };
    const Status status = caught([&] { return engine->commit(epoch, applied, batch->puts, batch->deletes); });
    if (status.ok()) batch->trimmed = caught([&] { return engine->trim(applied); });
    if (written) written();
    return status;
  };
  // If no thread can be started, finish_commit() writes it.
  committing->written = std::async(std::launch::async | std::launch::deferred, write);
  return {};
} catch (const StatusError& error) {
  return error.status();  // a part to be gathered could not be read
}

std::optional<Status> Map::Impl::finish_commit() {
  if (!committing) return std::nullopt;
  publish();
  const Status status =
      committing->written.valid() ? committing->written.get() : Status(Reason::BUDGET_EXCEEDED, "out of memory");
  const std::unique_ptr<Commit> commit = std::move(committing);
  budget->release(Share::kCache, commit->cache_bytes);
  if (!status.ok()) {
    restore(*commit);
    return status;
  }
  complete(*commit);
  return commit->batch->trimmed;
}

// Makes what the commit held dirty again, except where something newer is dirty. All of it has been published.
void Map::Impl::restore(Commit& commit) noexcept {
  const auto take_back = [&](auto& old, auto& now, bool removed) {
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
      if (!old.frames[slot]) continue;
      if (now.frames[slot] || removed) {
        ledger->retire(old.since[slot], now.since[slot], old.bytes[slot]);
        budget->release(Share::kDirty, old.bytes[slot]);
        dirty_bytes -= old.bytes[slot];
      } else {
        now.frames[slot] = std::move(old.frames[slot]);
        now.since[slot] = old.since[slot];
        now.bytes[slot] = old.bytes[slot];
      }
    }
  };
  for (auto& [id, chunk] : commit.chunks) {
    const auto [at, fresh] = dirty.try_emplace(id);
    if (!fresh) {
      budget->release(Share::kDirty, kEmptyChunk);
      dirty_bytes -= kEmptyChunk;
    }
    const bool removed = at->second.removed;
    at->second.removed = removed || chunk.removed;
    take_back(chunk.hot, at->second.hot, removed);
    take_back(chunk.warm, at->second.warm, removed);
    take_back(chunk.cold, at->second.cold, removed);
  }
  for (const auto& session : commit.sessions) dirty_sessions.insert(session->number);
  events.failed();
  event_bytes += commit.event_bytes;
  charge_events();  // what was kept in two places may take less in one
  state.pending.add_changes(commit.pending);
  changed_edits.merge(commit.edits);
  spare_hot.clear();  // what could not be written needs the room
  charge_rest();
}

namespace {

// The parts of a batch as the cache keeps them. Takes their bytes out of the puts.
template <typename Frame, typename Batch>
std::vector<ChunkCache::Written<Frame>> written(Batch& batch,
                                                const std::vector<typename Batch::template Part<Frame>>& parts) {
  std::vector<ChunkCache::Written<Frame>> all(parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    all[i].id = parts[i].id;
    all[i].whole = parts[i].whole;
    std::uint64_t commit = 0;
    for (std::size_t put = parts[i].first; put < parts[i].last; ++put)
      (void)unpack<Frame>(std::make_shared<const Bytes>(std::move(batch.puts[put].value)), parts[i].id, all[i].records,
                          &commit);  // cannot fail: packed a moment ago
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) all[i].records[slot].frame = parts[i].decoded[slot];
  }
  return all;
}

}  // namespace

void Map::Impl::complete(Commit& commit) noexcept {
  snapshot = engine->snapshot();
  events.committed();
  recent_hot.clear();
  recent_warm.clear();
  cache->committed(snapshot->commit_number(), written<FrameHot>(*commit.batch, commit.batch->hot),
                   written<FrameWarm>(*commit.batch, commit.batch->warm), commit.sessions);

  // Hot and warm parts live on in the cache, cold ones only in the views that still have them.
  for (const auto& [id, chunk] : commit.chunks)
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
      if (chunk.cold.frames[slot]) ledger->retire(chunk.cold.since[slot], version + 1, chunk.cold.bytes[slot]);
  budget->release(Share::kDirty, commit.bytes);
  dirty_bytes -= commit.bytes;
  std::erase_if(sessions, [&](const auto& session) { return !dirty_sessions.contains(session->number); });
  for (const auto& [entry, present] : commit.labels)
    if (const auto at = labels.find(entry); at->second == present) labels.erase(at);
  for (const auto& [entry, item] : commit.skipped)
    if (const auto at = skipped.find(entry); at->second == item) skipped.erase(at);

  spare_hot.clear();  // like what was dirty, they make room for what is read
  charge_rest();

  // What was edited meanwhile stays dirty on top of the new snapshot.
  auto table = std::make_shared<DirtyTable>();
  for (const auto& [id, chunk] : dirty) {
    auto left = std::make_shared<DirtyChunk>();
    std::copy(chunk.hot.frames.begin(), chunk.hot.frames.end(), left->hot.begin());
    std::copy(chunk.warm.frames.begin(), chunk.warm.frames.end(), left->warm.begin());
    std::copy(chunk.cold.frames.begin(), chunk.cold.frames.end(), left->cold.begin());
    left->removed = chunk.removed;
    table->emplace_back(id, std::move(left));
  }
  published_dirty = std::move(table);
  published_labels = std::make_shared<const LabelChanges>(labels);
  published_skipped = std::make_shared<const SkippedTable>(skipped);
  publish_sessions();
  show();
}

}  // namespace relmap::storage
