// Accounts for every byte that grows with the map, the load or the number of callers (docs/architecture.md). Over the
// budget, memory is first evicted, then refused with BUDGET_EXCEEDED; it never grows.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string_view>

#include "proto/base/mutex.h"

namespace relmap::storage {

enum class Share : std::uint8_t {
  kDirty,   // chunk parts changed since the last commit
  kCache,   // clean chunk parts: all of it can be evicted
  kViews,   // parts held only by old views
  kEngine,  // RocksDB's cache and memtables
  kPlaceIndex,
  kQueues,      // keyframes between the journal and the worker
  kReassembly,  // keyframes of which parts are missing
  kReplies,
  kSessions,   // what is known of each session beside its frames, and which frames wait for relaxation
  kRoutes,     // cells (server/route/overlay): they can all be read again, or made again, from disk
  kAllocator,  // what the allocator's pages hold beyond what was asked for: holes that nobody fills
  kPictures,   // a fixed reserve beside the limit, not part of it
};
inline constexpr std::size_t kShares = 12;
std::string_view share_name(Share share);

inline constexpr std::size_t kPictureReserve = std::size_t{120} << 20;

// Thread-safe; counters are exact, the limit is checked at every reservation.
class Budget {
 public:
  explicit Budget(std::size_t limit_bytes);

  std::size_t limit() const { return limit_; }
  std::size_t used() const;               // without kPictures
  std::size_t used_beside_cache() const;  // without kPictures and kCache
  std::size_t used(Share share) const;

  // The bytes that a share may take at most. Fixed parts of the limit: engine and place index 1/4 each, dirty and views
  // 1/8 each, queues, reassembly, replies and sessions 1/16 each. The cache may take what the others leave, routes 3/4
  // of what all others but the cache leave, and pictures their reserve. At most 1/8 is counted of the allocator's
  // holes, for which cache and routes make room; nothing else is refused for their sake.
  std::size_t allowance(Share share) const;

  // Returns false and charges nothing if the share would exceed its allowance, or if the limit would be exceeded even
  // after cache and routes have given way.
  bool try_charge(Share share, std::size_t bytes);
  // Charges whatever the limit says: for memory that already exists. The caller evicts next.
  void charge(Share share, std::size_t bytes);
  void release(Share share, std::size_t bytes);
  // Sets the bytes of a share that is measured rather than counted (engine, place index, allocator).
  void set(Share share, std::size_t bytes);

  // `evict` is called, from any thread, when the growth of another share has taken the total over the limit: the cache
  // makes room and, where that is not enough, the routes do. It may release() but not charge.
  void add_evictor(const void* owner, std::function<void()> evict);
  void remove_evictor(const void* owner);  // when this returns, no call to it is under way

 private:
  static bool gives_way(Share share) { return share == Share::kCache || share == Share::kRoutes; }
  std::size_t sum(bool with_cache, bool with_routes) const;
  void relieve(Share grown);

  const std::size_t limit_;
  std::array<std::atomic<std::size_t>, kShares> used_{};
  Mutex mutex_;
  std::map<const void*, std::function<void()>> evictors_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::storage
