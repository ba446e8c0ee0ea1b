#include "storage/chunk_cache.h"

#include <algorithm>

#include "storage/part_loader.h"

namespace relmap {
namespace {

template <typename Frame>
std::size_t slots_bytes(const Slots<Frame>& slots) {
  std::size_t bytes = sizeof slots;
  for (const auto& frame : slots)
    if (frame) bytes += memory_bytes(*frame);
  return bytes;
}

LoadedPart<FrameHot> load(const EngineSnapshot& snapshot, ChunkId id, const FrameHot*) {
  return load_hot(snapshot, id);
}
LoadedPart<FrameWarm> load(const EngineSnapshot& snapshot, ChunkId id, const FrameWarm*) {
  return load_warm(snapshot, id);
}

}  // namespace

ChunkCache::ChunkCache(std::shared_ptr<Budget> budget, std::uint64_t current)
    : budget_(std::move(budget)), current_(current) {
  budget_->add_evictor(this, [this] { evict(); });
}

ChunkCache::~ChunkCache() {
  budget_->remove_evictor(this);
  clear();
}

template <typename Frame>
std::shared_ptr<const Slots<Frame>> ChunkCache::part(const EngineSnapshot& snapshot, Part part, ChunkId id) {
  const Key key{part, id.session, id.chunk};
  if (auto cached = find(key, snapshot.commit_number()))
    return std::static_pointer_cast<const Slots<Frame>>(std::move(cached));
  auto loaded = load(snapshot, id, static_cast<const Frame*>(nullptr));
  auto frames = std::make_shared<const Slots<Frame>>(std::move(loaded.frames));
  if (loaded.commit != 0) insert({key, frames, loaded.commit, 0, loaded.bytes}, snapshot.commit_number());
  return frames;
}

std::shared_ptr<const Slots<FrameHot>> ChunkCache::hot(const EngineSnapshot& snapshot, ChunkId id) {
  return part<FrameHot>(snapshot, Part::kHot, id);
}

std::shared_ptr<const Slots<FrameWarm>> ChunkCache::warm(const EngineSnapshot& snapshot, ChunkId id) {
  return part<FrameWarm>(snapshot, Part::kWarm, id);
}

std::shared_ptr<const FrameCold> ChunkCache::cold(const EngineSnapshot& snapshot, FrameId id) {
  const Key key{Part::kCold, id.session, id.index};
  if (auto cached = find(key, snapshot.commit_number()))
    return std::static_pointer_cast<const FrameCold>(std::move(cached));
  const LoadedCold loaded = load_cold(snapshot, id);
  if (loaded.frame)
    insert({key, loaded.frame, loaded.commit, 0, memory_bytes(*loaded.frame)}, snapshot.commit_number());
  return loaded.frame;
}

template <typename Frame>
void ChunkCache::update(const std::shared_ptr<const Slots<Frame>>& frames, Part part, ChunkId id, bool whole,
                        std::uint64_t number) {
  if (!frames) return;
  const Key key{part, id.session, id.chunk};
  const auto before = version_locked(key, number);
  auto value = frames;
  if (!whole) {
    if (before == index_.end()) return;  // the next reader loads it
    auto merged = std::make_shared<Slots<Frame>>(*static_cast<const Slots<Frame>*>(before->second->value.get()));
    for (std::size_t slot = 0; slot < frames->size(); ++slot)
      if ((*frames)[slot]) (*merged)[slot] = (*frames)[slot];
    value = std::move(merged);
  }
  if (before != index_.end()) before->second->through = number - 1;
  insert_locked({key, value, number, kNewest, slots_bytes(*value)});
}

void ChunkCache::committed(std::uint64_t number, std::span<const Written> written) {
  const std::lock_guard lock(mutex_);
  current_ = number;
  for (const Written& chunk : written) {
    update(chunk.hot, Part::kHot, chunk.id, chunk.whole, number);
    update(chunk.warm, Part::kWarm, chunk.id, chunk.whole, number);
  }
  evict_locked();
}

ChunkCache::Versions::iterator ChunkCache::version_locked(const Key& key, std::uint64_t commit) {
  const auto [first, last] = index_.equal_range(key);
  for (auto at = first; at != last; ++at)
    if (at->second->from <= commit && commit <= at->second->through) return at;
  return index_.end();
}

std::shared_ptr<const void> ChunkCache::find(const Key& key, std::uint64_t commit) {
  const std::lock_guard lock(mutex_);
  const auto found = version_locked(key, commit);
  if (found == index_.end()) return nullptr;
  lru_.splice(lru_.begin(), lru_, found->second);
  return found->second->value;
}

void ChunkCache::insert(Entry entry, std::uint64_t loaded_at) {
  const std::lock_guard lock(mutex_);
  entry.through = loaded_at == current_ ? kNewest : loaded_at;
  insert_locked(std::move(entry));
  evict_locked();
}

// A version that is there already (its writer is its identity) only learns how long it holds.
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
  while (!lru_.empty() && budget_->used(Share::kCache) > budget_->allowance(Share::kCache))
    erase_locked(std::prev(lru_.end()));
}

void ChunkCache::evict() {
  const std::lock_guard lock(mutex_);
  evict_locked();
}

void ChunkCache::clear() {
  const std::lock_guard lock(mutex_);
  while (!lru_.empty()) erase_locked(lru_.begin());
}

}  // namespace relmap
