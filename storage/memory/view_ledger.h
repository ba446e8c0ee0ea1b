// Accounts for the bytes that only old views hold. When a part is replaced, each view that can still see it keeps it.
// Its bytes are charged to Share::kViews until the last of these views is released. When the share exceeds its
// allowance, the oldest views are cut off: their reads fail with VIEW_EXPIRED, and who keeps them lets them go.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "proto/base/mutex.h"
#include "storage/memory/budget.h"

namespace relmap::storage {

// Thread-safe.
class ViewLedger {
 public:
  explicit ViewLedger(std::shared_ptr<Budget> budget) : budget_(std::move(budget)) {}

  // A view of this version has been made, or has ended. Versions must grow.
  void add(std::uint64_t version);
  void remove(std::uint64_t version);

  // A part of `bytes` that views have shown since version `created` is no longer in the views from `retired` on.
  void retire(std::uint64_t created, std::uint64_t retired, std::size_t bytes);

  bool expired(std::uint64_t version) const { return version < expired_below_.load(std::memory_order_relaxed); }

 private:
  struct Retired {
    std::uint64_t created;
    std::size_t bytes;
  };
  // A view, and the parts of which it is the newest holder: when it ends, they are freed, or pass to the next older
  // view. So each part is counted once, however many views see it.
  struct LiveView {
    std::uint64_t version = 0;
    std::vector<Retired> parts;
    std::size_t bytes = 0;  // of `parts`
  };
  // The first of live_ whose version is at least this.
  std::vector<LiveView>::iterator from(std::uint64_t version) RELMAP_REQUIRES(mutex_);
  // Gives the part to the view before `end` in live_, if that one sees it. False if it does not: nobody holds the part.
  bool hold_before(std::vector<LiveView>::iterator end, const Retired& part) RELMAP_REQUIRES(mutex_);
  void expire() RELMAP_REQUIRES(mutex_);

  const std::shared_ptr<Budget> budget_;
  Mutex mutex_;
  std::vector<LiveView> live_ RELMAP_GUARDED_BY(mutex_);  // ascending
  std::vector<Retired> spare_ RELMAP_GUARDED_BY(mutex_);  // memory of a view that ended, for the next
  std::atomic<std::uint64_t> expired_below_{0};
};

}  // namespace relmap::storage
