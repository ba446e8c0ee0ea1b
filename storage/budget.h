// One accountant for every byte that grows with the map, the load or the number of callers (DESIGN, "Readers and
// memory"). Over the budget the order is: evict, then refuse with BUDGET_EXCEEDED; never grow.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace relmap {

enum class Share : std::uint8_t {
  kDirty,   // chunk parts changed since the last commit
  kCache,   // clean chunk parts
  kViews,   // parts held only by old views
  kEngine,  // RocksDB's cache and memtables
  kPlaceIndex,
  kQueues,      // keyframes between the journal and the worker
  kReassembly,  // keyframes of which parts are missing
  kReplies,
  kPictures,
};
inline constexpr std::size_t kShares = 9;
std::string_view share_name(Share share);

// Thread-safe; counters are exact, the limit is checked at every reservation.
class Budget {
 public:
  explicit Budget(std::size_t limit_bytes);

  std::size_t limit() const { return limit_; }
  std::size_t used() const;
  std::size_t used(Share share) const;

  // What a share may take of the whole. Fixed parts of the limit: dirty 1/8, engine 1/4, the cache what the others
  // leave.
  std::size_t allowance(Share share) const;

  // False, and nothing is charged, if that would pass the share's allowance or the limit.
  bool try_charge(Share share, std::size_t bytes);
  // Charged whatever the limit says: for memory that already exists. The caller evicts next.
  void charge(Share share, std::size_t bytes);
  void release(Share share, std::size_t bytes);
  // For shares that are measured rather than counted (engine, place index).
  void set(Share share, std::size_t bytes);

 private:
  const std::size_t limit_;
  std::array<std::atomic<std::size_t>, kShares> used_{};
};

}  // namespace relmap
