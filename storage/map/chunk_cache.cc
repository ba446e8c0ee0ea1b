#include "storage/map/chunk_cache.h"

#include <algorithm>

#include "proto/base/mutex.h"
#include "storage/map/part_loader.h"
#include "storage/map/session_records.h"

namespace relmap::storage {
ChunkCache::ChunkCache(std::shared_ptr<Budget> budget, std::uint64_t current)
    : budget_(std::move(budget)),
      absent_(std::make_shared<const PackedPart<FrameHot>>(budget_, ChunkId{}, PackedPart<FrameHot>::Records{}),
              std::make_shared<const PackedPart<FrameWarm>>(budget_, ChunkId{}, PackedPart<FrameWarm>::Records{})),
      current_(current) {
  budget_->add_evictor(this, [this] { evict(); });
}

ChunkCache::~ChunkCache() {
  budget_->remove_evictor(this);
  clear();
}

template <typename Frame>
std::shared_ptr<const PackedPart<Frame>> ChunkCache::part(const EngineSnapshot& snapshot, ChunkId id) {
  const Key key{kPartOf<Frame>, id.session, id.chunk};
  if (auto cached = find(key, snapshot.commit_number()))
    return std::static_pointer_cast<const PackedPart<Frame>>(std::move(cached));
  auto loaded = load_packed<Frame>(snapshot, id, budget_);
  if (loaded.commit == 0) {  // it never existed, or was removed: all that is known is that it is not there now
    loaded.part = std::get<std::shared_ptr<const PackedPart<Frame>>>(absent_);
    loaded.commit = snapshot.commit_number();
  }
  insert({key, loaded.part, loaded.commit, 0, sizeof(Entry)}, snapshot.commit_number());
  return loaded.part;
}

template <typename Frame>
std::shared_ptr<const Frame> ChunkCache::frame(const PackedPart<Frame>& part, std::uint32_t slot) {
  auto frame = part.frame(slot);
  if (budget_->used(Share::kCache) > budget_->allowance(Share::kCache)) evict();
  return frame;
}

Slots<FrameHot> ChunkCache::hot_frames(const EngineSnapshot& snapshot, ChunkId id, std::uint64_t slots) {
  auto frames = part<FrameHot>(snapshot, id)->frames(slots);
  if (budget_->used(Share::kCache) > budget_->allowance(Share::kCache)) evict();
  return frames;
}

template std::shared_ptr<const PackedPart<FrameHot>> ChunkCache::part(const EngineSnapshot&, ChunkId);
template std::shared_ptr<const PackedPart<FrameWarm>> ChunkCache::part(const EngineSnapshot&, ChunkId);
template std::shared_ptr<const FrameHot> ChunkCache::frame(const PackedPart<FrameHot>&, std::uint32_t);
template std::shared_ptr<const FrameWarm> ChunkCache::frame(const PackedPart<FrameWarm>&, std::uint32_t);

std::shared_ptr<const Session> ChunkCache::session(const EngineSnapshot& snapshot, SessionNumber number) {
  const Key key{std::nullopt, number, 0};
  if (auto cached = find(key, snapshot.commit_number()))
    return std::static_pointer_cast<const Session>(std::move(cached));
  auto loaded = load_session(snapshot, number);
  if (!loaded) return nullptr;
  auto session = std::make_shared<const Session>(*std::move(loaded));
  // Which commit wrote the record is not known; it holds at that of the snapshot.
  const std::uint64_t commit = snapshot.commit_number();
  insert({key, session, commit, 0, sizeof(Entry) + memory_bytes(*session)}, commit);
  return session;
}

void ChunkCache::hold_session(SessionNumber number) {
  const MutexLock lock(mutex_);
  ++held_[number];
}

void ChunkCache::let_go_session(SessionNumber number) {
  const MutexLock lock(mutex_);
  if (const auto held = held_.find(number); --held->second == 0) held_.erase(held);
}

std::shared_ptr<const FrameCold> ChunkCache::cold(const EngineSnapshot& snapshot, FrameId id) {
  const Key key{Part::kCold, id.session, id.index};
  if (auto cached = find(key, snapshot.commit_number()))
    return std::static_pointer_cast<const FrameCold>(std::move(cached));
  const LoadedCold loaded = load_cold(snapshot, id);
  if (loaded.frame) {
    insert({key, loaded.frame, loaded.commit, 0, memory_bytes(*loaded.frame)}, snapshot.commit_number());
    return loaded.frame;
  }
  static const auto kNothing = std::make_shared<const FrameCold>();
  const auto hot = frame<FrameHot>(snapshot, id);
  if (!hot) return nullptr;
  if (hot->appearance_count > 0) throw_lost(Part::kCold, "frame " + id.to_string(), "missing");
  return kNothing;
}

template <typename Frame>
void ChunkCache::update(const Written<Frame>& written, std::uint64_t number) {
  const Key key{kPartOf<Frame>, written.id.session, written.id.chunk};
  const auto before = version_locked(key, number);
  auto records = written.records;
  if (!written.whole) {
    if (before == index_.end()) return;  // the next reader loads it
    const auto& old = *static_cast<const PackedPart<Frame>*>(before->second->value.get());
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
      if (!records[slot].there()) records[slot] = old.record(slot);
  }
  supersede({key, std::make_shared<const PackedPart<Frame>>(budget_, written.id, std::move(records)), number, kNewest,
             sizeof(Entry)});
}

void ChunkCache::supersede(Entry entry) {
  if (const auto before = version_locked(entry.key, entry.from); before != index_.end())
    before->second->through = entry.from - 1;
  insert_locked(std::move(entry));
}

void ChunkCache::committed(std::uint64_t number, std::span<const Written<FrameHot>> hot,
                           std::span<const Written<FrameWarm>> warm,
                           std::span<const std::shared_ptr<const Session>> sessions) {
  const MutexLock lock(mutex_);
  current_ = number;
  for (const auto& session : sessions)
    supersede({{std::nullopt, session->number, 0}, session, number, kNewest, sizeof(Entry) + memory_bytes(*session)});
  for (const auto& written : hot) update(written, number);
  for (const auto& written : warm) update(written, number);
  evict_locked();
}

ChunkCache::Versions::iterator ChunkCache::version_locked(const Key& key, std::uint64_t commit) {
  const auto [first, last] = index_.equal_range(key);
  for (auto at = first; at != last; ++at)
    if (at->second->from <= commit && commit <= at->second->through) return at;
  return index_.end();
}

std::shared_ptr<const void> ChunkCache::find(const Key& key, std::uint64_t commit) {
  const MutexLock lock(mutex_);
  const auto found = version_locked(key, commit);
  if (found == index_.end()) return nullptr;
  lru_.splice(lru_.begin(), lru_, found->second);
  return found->second->value;
}

void ChunkCache::insert(Entry entry, std::uint64_t loaded_at) {
  const MutexLock lock(mutex_);
  entry.from = std::min(entry.from, loaded_at);  // a part may name a commit to come, as of a map that was copied
  entry.through = loaded_at == current_ ? kNewest : loaded_at;
  insert_locked(std::move(entry));
  evict_locked();
}

// If the cache has this version already (the commit that wrote it identifies it), only the last commit for which it
// holds is raised.
void ChunkCache::insert_locked(Entry entry) {
  const auto [first, last] = index_.equal_range(entry.key);
  for (auto at = first; at != last; ++at)
    if (at->second->from == entry.from) {
      at->second->through = std::max(at->second->through, entry.through);
      return;
    }
  budget_->charge(Share::kCache, entry.bytes);
  lru_.push_front(std::move(entry));
  index_.emplace(lru_.front().key, lru_.begin());
}

void ChunkCache::erase_locked(Lru::iterator entry) {
  budget_->release(Share::kCache, entry->bytes);
  const auto [first, last] = index_.equal_range(entry->key);
  for (auto at = first; at != last; ++at)
    if (at->second == entry) {
      index_.erase(at);
      break;
    }
  lru_.erase(entry);
}

void ChunkCache::evict_locked() {
  // What is held is looked at once and becomes the most recent, so that the next call need not pass it.
  for (std::size_t left = lru_.size(); left > 0 && budget_->used(Share::kCache) > budget_->allowance(Share::kCache);
       --left) {
    const auto last = std::prev(lru_.end());
    if (!last->key.part && last->through == kNewest && held_.contains(last->key.session))
      lru_.splice(lru_.begin(), lru_, last);
    else
      erase_locked(last);
  }
}

void ChunkCache::evict() {
  const MutexLock lock(mutex_);
  evict_locked();
}

void ChunkCache::clear() {
  const MutexLock lock(mutex_);
  while (!lru_.empty()) erase_locked(lru_.begin());
}

}  // namespace relmap::storage
