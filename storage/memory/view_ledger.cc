#include "storage/memory/view_ledger.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "proto/base/mutex.h"

namespace relmap::storage {

void ViewLedger::add(std::uint64_t version) {
  const MutexLock lock(mutex_);
  live_.push_back({version, std::exchange(spare_, {})});
}

void ViewLedger::remove(std::uint64_t version) {
  const MutexLock lock(mutex_);
  const auto ended = from(version);
  for (const Retired& part : ended->parts)
    if (!hold_before(ended, part)) budget_->release(Share::kViews, part.bytes);
  ended->parts.clear();
  spare_ = std::move(ended->parts);
  live_.erase(ended);
}

void ViewLedger::retire(std::uint64_t created, std::uint64_t retired, std::size_t bytes) {
  const MutexLock lock(mutex_);
  if (!hold_before(from(retired), {created, bytes})) return;
  budget_->charge(Share::kViews, bytes);
  if (budget_->used(Share::kViews) > budget_->allowance(Share::kViews)) expire();
}

std::vector<ViewLedger::LiveView>::iterator ViewLedger::from(std::uint64_t version) {
  return std::lower_bound(live_.begin(), live_.end(), version,
                          [](const LiveView& view, std::uint64_t key) { return view.version < key; });
}

bool ViewLedger::hold_before(std::vector<LiveView>::iterator end, const Retired& part) {
  if (end == live_.begin()) return false;
  LiveView& newest = *std::prev(end);
  if (newest.version < part.created) return false;
  newest.parts.push_back(part);
  newest.bytes += part.bytes;
  return true;
}

// Cuts off the oldest views until the others hold no more than the allowance.
void ViewLedger::expire() {
  const std::size_t allowance = budget_->allowance(Share::kViews);
  std::size_t held = budget_->used(Share::kViews);
  std::uint64_t below = expired_below_.load(std::memory_order_relaxed);
  for (auto view = live_.begin(); view != live_.end() && held > allowance; ++view) {
    held -= view->bytes;
    below = std::max(below, view->version + 1);
  }
  expired_below_.store(below, std::memory_order_relaxed);
}

}  // namespace relmap::storage
