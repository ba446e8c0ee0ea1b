#include "storage/memory/view_ledger.h"

#include <algorithm>

#include "proto/base/mutex.h"

namespace relmap::storage {

void ViewLedger::add(std::uint64_t version) {
  const MutexLock lock(mutex_);
  live_.push_back(version);
}

void ViewLedger::remove(std::uint64_t version) {
  const MutexLock lock(mutex_);
  live_.erase(std::lower_bound(live_.begin(), live_.end(), version));
  std::erase_if(retired_, [&](const Retired& part) RELMAP_REQUIRES(mutex_) {
    if (version < part.created || version >= part.retired || held(part, 0)) return false;
    budget_->release(Share::kViews, part.bytes);
    return true;
  });
}

void ViewLedger::retire(std::uint64_t created, std::uint64_t retired, std::size_t bytes) {
  const MutexLock lock(mutex_);
  const Retired part{created, retired, bytes};
  if (!held(part, 0)) return;
  retired_.push_back(part);
  budget_->charge(Share::kViews, bytes);
  if (budget_->used(Share::kViews) > budget_->allowance(Share::kViews)) expire();
}

bool ViewLedger::held(const Retired& part, std::uint64_t from) const {
  const auto it = std::lower_bound(live_.begin(), live_.end(), std::max(part.created, from));
  return it != live_.end() && *it < part.retired;
}

// Cuts off the oldest views until the others hold no more than the allowance.
void ViewLedger::expire() {
  const std::size_t allowance = budget_->allowance(Share::kViews);
  std::uint64_t below = expired_below_.load(std::memory_order_relaxed);
  for (auto view = std::lower_bound(live_.begin(), live_.end(), below); view != live_.end(); ++view) {
    std::size_t bytes = 0;
    for (const Retired& part : retired_)
      if (held(part, below)) bytes += part.bytes;
    if (bytes <= allowance) break;
    below = *view + 1;
  }
  expired_below_.store(below, std::memory_order_relaxed);
}

}  // namespace relmap::storage
