// Accounts for the bytes that only old views hold. When a part is replaced, each view that can still see it (versions
// [created, retired)) keeps it. Its bytes are charged to Share::kViews until the last of these views is released. When
// the share exceeds its allowance, the oldest views are cut off: their reads fail with VIEW_EXPIRED.
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
    std::uint64_t created, retired;
    std::size_t bytes;
  };
  bool held(const Retired& part, std::uint64_t from) const
      RELMAP_REQUIRES(mutex_);  // by a live view not older than `from`
  void expire() RELMAP_REQUIRES(mutex_);

  const std::shared_ptr<Budget> budget_;
  Mutex mutex_;
  std::vector<std::uint64_t> live_ RELMAP_GUARDED_BY(mutex_);  // ascending
  std::vector<Retired> retired_ RELMAP_GUARDED_BY(mutex_);
  std::atomic<std::uint64_t> expired_below_{0};
};

}  // namespace relmap::storage
