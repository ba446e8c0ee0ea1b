// Committed parts, as a snapshot shows them, through one cache of decoded parts that the worker and all views share.
//
// An entry is one version of a part. It knows for which commits that version is known to be right: from the commit that
// wrote it through the last commit at which a snapshot was seen to hold it; for the newest version, through all commits
// to come. A reader gets an entry only if the commit of its own snapshot lies in that range, so no reader ever sees a
// version that is not its own, and readers of an old snapshot are served as well as those of the newest. That a chunk
// does not exist is cached too, so that a gap in a session is walked over in memory.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <span>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "proto/base/mutex.h"
#include "storage/engine/engine.h"
#include "storage/format/packed_part.h"
#include "storage/memory/budget.h"

namespace relmap::storage {

// Thread-safe. Reads throw StatusError (IO_ERROR, DATA_LOSS).
class ChunkCache {
 public:
  // `current`: number of the newest commit.
  ChunkCache(std::shared_ptr<Budget> budget, std::uint64_t current);
  ~ChunkCache();
  ChunkCache(const ChunkCache&) = delete;
  ChunkCache& operator=(const ChunkCache&) = delete;

  // Never null; a chunk that does not exist gives a part without frames.
  template <typename Frame>  // FrameHot or FrameWarm
  std::shared_ptr<const PackedPart<Frame>> part(const EngineSnapshot& snapshot, ChunkId id);
  // part.frame(slot). Decoding the frame may take more memory; then other entries are evicted.
  template <typename Frame>
  std::shared_ptr<const Frame> frame(const PackedPart<Frame>& part, std::uint32_t slot);

  // Null if there is no such frame.
  template <typename Frame>
  std::shared_ptr<const Frame> frame(const EngineSnapshot& snapshot, FrameId id) {
    return frame(*part<Frame>(snapshot, chunk_id(id)), slot_of(id));
  }
  // The frames of a chunk whose bits are set in `slots`.
  Slots<FrameHot> hot_frames(const EngineSnapshot& snapshot, ChunkId id, std::uint64_t slots);
  // Null if there is no such session.
  std::shared_ptr<const Session> session(const EngineSnapshot& snapshot, SessionNumber number);
  // The newest record of the session stays in the cache, once it is there, until let_go_session() was called as often.
  void hold_session(SessionNumber number);
  void let_go_session(SessionNumber number);
  // Cold parts are cached frame by frame.
  std::shared_ptr<const FrameCold> cold(const EngineSnapshot& snapshot, FrameId id);

  // What a commit wrote of a part. `whole`: `records` is all of the part; otherwise it has the frames that were
  // written, and the others are as before.
  template <typename Frame>
  struct Written {
    ChunkId id;
    typename PackedPart<Frame>::Records records;
    bool whole = false;
  };
  // Tells the cache that commit `number` is the newest from now on. To be called before any reader has a snapshot of
  // it.
  void committed(std::uint64_t number, std::span<const Written<FrameHot>> hot, std::span<const Written<FrameWarm>> warm,
                 std::span<const std::shared_ptr<const Session>> sessions);

  const std::shared_ptr<Budget>& budget() const { return budget_; }

  // Drops the least recently used entries that are not held until the cache keeps to its allowance.
  void evict();
  void clear();

 private:
  struct Key {
    std::optional<Part> part;  // nullopt: the session's record
    SessionNumber session;
    std::uint32_t number;  // of the chunk, or the frame's index; 0 for the session's record
    bool operator==(const Key&) const = default;
  };
  struct KeyHash {
    std::size_t operator()(const Key& key) const noexcept {
      const std::uint64_t part = key.part ? 1 + static_cast<std::uint64_t>(*key.part) : 0;
      return detail::mix(((std::uint64_t{key.session} << 32) | key.number) * 8 + part);
    }
  };
  static constexpr std::uint64_t kNewest = ~std::uint64_t{0};
  struct Entry {
    Key key;
    std::shared_ptr<const void> value;
    std::uint64_t from = 0;           // the commit that wrote it
    std::uint64_t through = kNewest;  // the last commit at which it is known to hold
    std::size_t bytes = 0;            // besides those that a part charges itself
  };
  using Lru = std::list<Entry>;  // most recently used first
  using Versions = std::unordered_multimap<Key, Lru::iterator, KeyHash>;

  template <typename Frame>
  void update(const Written<Frame>& written, std::uint64_t number) RELMAP_REQUIRES(mutex_);
  void supersede(Entry entry) RELMAP_REQUIRES(mutex_);  // by what commit entry.from wrote
  std::shared_ptr<const void> find(const Key& key, std::uint64_t commit);
  void insert(Entry entry, std::uint64_t loaded_at);
  void insert_locked(Entry entry) RELMAP_REQUIRES(mutex_);
  Versions::iterator version_locked(const Key& key, std::uint64_t commit) RELMAP_REQUIRES(mutex_);
  void erase_locked(Lru::iterator entry) RELMAP_REQUIRES(mutex_);
  void evict_locked() RELMAP_REQUIRES(mutex_);

  const std::shared_ptr<Budget> budget_;
  const std::tuple<std::shared_ptr<const PackedPart<FrameHot>>, std::shared_ptr<const PackedPart<FrameWarm>>> absent_;
  Mutex mutex_;
  std::uint64_t current_ RELMAP_GUARDED_BY(mutex_);
  Lru lru_ RELMAP_GUARDED_BY(mutex_);
  Versions index_ RELMAP_GUARDED_BY(mutex_);
  std::unordered_map<SessionNumber, std::size_t> held_ RELMAP_GUARDED_BY(mutex_);  // sessions, and how often
};

}  // namespace relmap::storage
