// How edits become durable: one atomic batch of the parts that are dirty.
//
// Hot and warm parts of a session's last chunk, which is open, are written frame by frame, as they change; when a frame
// of a later chunk has come, they are gathered into one value a part. Cold parts and words never change: they are
// written once, frame by frame.
#include "storage/chunk_codec.h"
#include "storage/frame_codec.h"
#include "storage/keys.h"
#include "storage/map_impl.h"
#include "storage/state_codec.h"

namespace relmap {

struct Map::Impl::Batch {
  std::uint64_t number = 0;  // of the commit
  std::vector<Put> puts;
  std::vector<std::string> deletes;
  std::vector<ChunkCache::Written> written;
};

namespace {

template <typename Body>
Bytes single(Part part, FrameId id, std::uint64_t commit, Body body) {
  ByteWriter w;
  body(w);
  PartWriter writer(part, chunk_id(id), commit);
  writer.add(slot_of(id), w.bytes());
  return writer.finish();
}

void encode(ByteWriter& w, const FrameHot& frame) { encode_hot(w, frame); }
void encode(ByteWriter& w, const FrameWarm& frame) { encode_warm(w, frame); }

template <typename Frame>
bool any(const std::array<std::shared_ptr<Frame>, kFramesPerChunk>& frames) {
  for (const auto& frame : frames)
    if (frame) return true;
  return false;
}

// What is dirty over what is committed.
template <typename Frame>
std::shared_ptr<const Slots<Frame>> merged(const Slots<Frame>* committed, const WorkingPart<Frame>& dirty) {
  auto slots = committed ? std::make_shared<Slots<Frame>>(*committed) : std::make_shared<Slots<Frame>>();
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
    if (dirty.frames[slot]) (*slots)[slot] = dirty.frames[slot];
  return slots;
}

template <typename Frame>
void put_frames(std::vector<Put>& puts, Part part, ChunkId id, std::uint64_t commit, const WorkingPart<Frame>& dirty) {
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
    if (!dirty.frames[slot]) continue;
    const FrameId frame = frame_in(id, slot);
    puts.push_back({keys::frame(part, frame),
                    single(part, frame, commit, [&](ByteWriter& w) { encode(w, *dirty.frames[slot]); })});
  }
}

template <typename Frame>
void put_gathered(std::vector<Put>& puts, Part part, ChunkId id, std::uint64_t commit, const Slots<Frame>& frames) {
  PartWriter writer(part, id, commit);
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
    if (!frames[slot]) continue;
    ByteWriter w;
    encode(w, *frames[slot]);
    writer.add(slot, w.bytes());
  }
  puts.push_back({keys::part(part, id), writer.finish()});
}

}  // namespace

void Map::Impl::write_chunk(Batch& batch, ChunkId id) {
  static const WorkingChunk kClean;
  const WorkingChunk* working = find(id);
  const WorkingChunk& chunk = working ? *working : kClean;

  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
    if (!chunk.cold.frames[slot]) continue;
    const FrameId frame = frame_in(id, slot);
    const FrameCold& cold = *chunk.cold.frames[slot];
    batch.puts.push_back({keys::frame(Part::kCold, frame),
                          single(Part::kCold, frame, batch.number, [&](ByteWriter& w) { encode_cold(w, cold); })});
    batch.puts.push_back(
        {keys::frame(Part::kWords, frame),
         single(Part::kWords, frame, batch.number, [&](ByteWriter& w) { encode_words(w, cold.words); })});
  }

  // How it stood at the last commit, and how it stands now.
  const auto before = committed_sessions.find(id.session);
  const bool existed = before != committed_sessions.end() && id.chunk <= chunk_of({id.session, before->second.last});
  const bool was_open = existed && id.chunk == chunk_of({id.session, before->second.last});
  const bool open = id.chunk >= chunk_of({id.session, find_session(sessions, id.session)->last});

  ChunkCache::Written written{id, nullptr, nullptr, !open || !existed};
  const bool hot_changed = any(chunk.hot.frames), warm_changed = any(chunk.warm.frames);
  if (open) {
    put_frames(batch.puts, Part::kHot, id, batch.number, chunk.hot);
    put_frames(batch.puts, Part::kWarm, id, batch.number, chunk.warm);
    if (hot_changed) written.hot = merged<FrameHot>(nullptr, chunk.hot);
    if (warm_changed) written.warm = merged<FrameWarm>(nullptr, chunk.warm);
  } else {
    if (hot_changed || was_open) {
      written.hot = merged(existed ? cache->hot(*snapshot, id).get() : nullptr, chunk.hot);
      put_gathered(batch.puts, Part::kHot, id, batch.number, *written.hot);
    }
    if (warm_changed || was_open) {
      written.warm = merged(existed ? cache->warm(*snapshot, id).get() : nullptr, chunk.warm);
      put_gathered(batch.puts, Part::kWarm, id, batch.number, *written.warm);
    }
    if (was_open)
      for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
        if (!(*written.hot)[slot]) continue;
        batch.deletes.push_back(keys::frame(Part::kHot, frame_in(id, slot)));
        batch.deletes.push_back(keys::frame(Part::kWarm, frame_in(id, slot)));
      }
  }
  if (written.hot || written.warm) batch.written.push_back(std::move(written));
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
  batch.puts.push_back({keys::map_state(), encode_state(state)});
}

Status Map::Impl::commit() try {
  publish();
  Batch batch;
  batch.number = engine->snapshot()->commit_number() + 1;

  std::set<ChunkId> chunks;
  for (const auto& [id, chunk] : dirty) chunks.insert(id);
  for (const SessionNumber number : dirty_sessions) {  // an open chunk may have closed without being touched
    const auto before = committed_sessions.find(number);
    if (before != committed_sessions.end()) chunks.insert(chunk_id({number, before->second.last}));
  }
  for (const ChunkId id : chunks) write_chunk(batch, id);
  write_rest(batch);

  if (Status status = engine->commit(epoch, state.applied_sequence, batch.puts, batch.deletes); !status.ok())
    return status;
  settle(batch);
  return engine->trim(state.applied_sequence);
} catch (const StatusError& error) {
  return error.status();  // a part to be gathered could not be read
}

void Map::Impl::settle(Batch& batch) {
  snapshot = engine->snapshot();
  recent_hot.clear();
  recent_warm.clear();
  cache->committed(snapshot->commit_number(), batch.written);

  // Hot and warm parts go on in the cache; cold ones only with the views that still have them.
  for (const auto& [id, chunk] : dirty)
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
      if (chunk.cold.frames[slot]) ledger->retire(chunk.cold.since[slot], version + 1, chunk.cold.bytes[slot]);
  dirty.clear();
  budget->release(Share::kDirty, dirty_bytes);
  dirty_bytes = 0;
  published_dirty = std::make_shared<const DirtyTable>();
  for (const SessionNumber number : dirty_sessions) committed_sessions[number] = *find_session(sessions, number);
  dirty_sessions.clear();
  labels.clear();
  published_labels = std::make_shared<const LabelChanges>();
  show();
}

}  // namespace relmap
