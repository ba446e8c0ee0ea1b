// One accountant for every byte that grows with the map, the load or the number of callers (docs/architecture.md).
// Over the budget the order is: evict, then refuse with BUDGET_EXCEEDED; never grow.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string_view>

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
  kSessions,  // what is known of each session beside its frames, and which frames wait for relaxation
  kRoutes,    // cells (server/route/overlay): they can all be read again, or made again, from disk
  kPictures,  // a fixed reserve beside the limit, not part of it
};
inline constexpr std::size_t kShares = 11;
std::string_view share_name(Share share);

inline constexpr std::size_t kPictureReserve = std::size_t{120} << 20;

// Thread-safe; counters are exact, the limit is checked at every reservation.
class Budget {
 public:
  explicit Budget(std::size_t limit_bytes);

  std::size_t limit() const { return limit_; }
  std::size_t used() const;               // kPictures apart
  std::size_t used_beside_cache() const;  // and the cache
  std::size_t used(Share share) const;

  // What a share may take of the whole. Fixed parts of the limit: engine and place index 1/4 each, dirty and views 1/8
  // each, queues, reassembly, replies and sessions 1/16 each; the cache what the others leave, and routes 3/4 of what
  // all others but the cache do; pictures their reserve.
  std::size_t allowance(Share share) const;

  // False, and nothing is charged, if that would pass the share's allowance or, once cache and routes have given way,
  // the limit.
  bool try_charge(Share share, std::size_t bytes);
  // Charged whatever the limit says: for memory that already exists. The caller evicts next.
  void charge(Share share, std::size_t bytes);
  void release(Share share, std::size_t bytes);
  // For shares that are measured rather than counted (engine, place index).
  void set(Share share, std::size_t bytes);

  // `evict` is called, from any thread, when another share's growth has taken the whole over the limit: the cache makes
  // room, and where that is not enough the routes. It may release() but not charge.
  void add_evictor(const void* owner, std::function<void()> evict);
  void remove_evictor(const void* owner);  // on return no call to it is under way

 private:
  static bool gives_way(Share share) { return share == Share::kCache || share == Share::kRoutes; }
  std::size_t sum(bool with_cache, bool with_routes) const;
  void relieve(Share grown);

  const std::size_t limit_;
  std::array<std::atomic<std::size_t>, kShares> used_{};
  std::mutex mutex_;
  std::map<const void*, std::function<void()>> evictors_;
};

}  // namespace relmap::storage
