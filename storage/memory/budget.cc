#include "storage/memory/budget.h"

#include <cassert>

#include "proto/base/mutex.h"

namespace relmap::storage {
namespace {

std::size_t index(Share share) { return static_cast<std::size_t>(share); }

}  // namespace

std::string_view share_name(Share share) {
  switch (share) {
    case Share::kDirty:
      return "dirty";
    case Share::kCache:
      return "cache";
    case Share::kViews:
      return "views";
    case Share::kEngine:
      return "engine";
    case Share::kPlaceIndex:
      return "place_index";
    case Share::kQueues:
      return "queues";
    case Share::kReassembly:
      return "reassembly";
    case Share::kReplies:
      return "replies";
    case Share::kSessions:
      return "sessions";
    case Share::kRoutes:
      return "routes";
    case Share::kAllocator:
      return "allocator";
    case Share::kPictures:
      return "pictures";
  }
  return "unknown";
}

Budget::Budget(std::size_t limit_bytes) : limit_(limit_bytes) {}

// Reads each counter once, and only adds. Subtracting a share from a total could go wrong while other threads count.
std::size_t Budget::sum(bool with_cache, bool with_routes) const {
  std::size_t sum = 0;
  for (std::size_t i = 0; i < kShares; ++i) {
    const bool counts = i == index(Share::kCache)       ? with_cache
                        : i == index(Share::kRoutes)    ? with_routes
                        : i == index(Share::kAllocator) ? with_cache || with_routes
                                                        : i != index(Share::kPictures);
    if (counts) sum += used_[i].load(std::memory_order_relaxed);
  }
  return sum;
}

std::size_t Budget::used() const { return sum(true, true); }
std::size_t Budget::used_beside_cache() const { return sum(false, true); }

std::size_t Budget::used(Share share) const { return used_[index(share)].load(std::memory_order_relaxed); }

std::size_t Budget::allowance(Share share) const {
  switch (share) {
    case Share::kEngine:
    case Share::kPlaceIndex:
      return limit_ / 4;
    case Share::kDirty:
    case Share::kViews:
    case Share::kAllocator:
      return limit_ / 8;
    case Share::kQueues:
    case Share::kReassembly:
    case Share::kReplies:
    case Share::kSessions:
      return limit_ / 16;
    case Share::kPictures:
      return kPictureReserve;
    case Share::kCache: {
      const std::size_t others = sum(false, true);
      return limit_ > others ? limit_ - others : 0;
    }
    case Share::kRoutes: {
      const std::size_t others = sum(false, false) + used(Share::kAllocator);
      return limit_ > others ? (limit_ - others) / 4 * 3 : 0;
    }
  }
  return 0;
}

bool Budget::try_charge(Share share, std::size_t bytes) {
  auto& counter = used_[index(share)];
  for (std::size_t mine = counter.load();;) {
    if (mine + bytes > allowance(share)) return false;
    if (counter.compare_exchange_weak(mine, mine + bytes)) break;
  }
  // Without the cache and the routes, since they give way.
  if (share != Share::kPictures && !gives_way(share) && sum(false, false) > limit_) {
    counter.fetch_sub(bytes);
    return false;
  }
  relieve(share);
  return true;
}

void Budget::charge(Share share, std::size_t bytes) {
  used_[index(share)].fetch_add(bytes);
  relieve(share);
}

void Budget::release(Share share, std::size_t bytes) {
  [[maybe_unused]] const std::size_t before = used_[index(share)].fetch_sub(bytes);
  assert(before >= bytes);
}

void Budget::set(Share share, std::size_t bytes) {
  used_[index(share)].store(bytes);
  relieve(share);
}

void Budget::add_evictor(const void* owner, std::function<void()> evict) {
  const MutexLock lock(mutex_);
  evictors_[owner] = std::move(evict);
}

void Budget::remove_evictor(const void* owner) {
  const MutexLock lock(mutex_);
  evictors_.erase(owner);
}

void Budget::relieve(Share grown) {
  if (grown == Share::kCache || grown == Share::kPictures || used() <= limit_) return;
  const MutexLock lock(mutex_);
  for (const auto& [owner, evict] : evictors_) evict();
}

}  // namespace relmap::storage
