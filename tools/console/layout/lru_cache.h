// Values that are dear to make, kept as long as they were used lately and fit.
#pragma once

#include <cstddef>
#include <list>
#include <map>
#include <memory>
#include <utility>

#include "proto/base/mutex.h"

namespace relmap::console {

// Thread-safe. Values are immutable, so those that were given out outlive their place here.
template <typename Key, typename Value>
class LruCache {
 public:
  // `max_bytes`: of all values together, as they are told; a single larger value is not kept.
  explicit LruCache(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  std::shared_ptr<const Value> find(const Key& key) {
    const MutexLock lock(mutex_);
    const auto found = by_key_.find(key);
    if (found == by_key_.end()) return {};
    kept_.splice(kept_.begin(), kept_, found->second);
    return found->second->value;
  }

  void keep(const Key& key, std::shared_ptr<const Value> value, std::size_t bytes) {
    const MutexLock lock(mutex_);
    if (by_key_.contains(key)) return;  // another thread made it meanwhile
    kept_.push_front({key, std::move(value), bytes});
    by_key_[key] = kept_.begin();
    bytes_ += bytes;
    while (bytes_ > max_bytes_) {
      bytes_ -= kept_.back().bytes;
      by_key_.erase(kept_.back().key);
      kept_.pop_back();
    }
  }

  std::size_t bytes() const {
    const MutexLock lock(mutex_);
    return bytes_;
  }

 private:
  struct Kept {
    Key key;
    std::shared_ptr<const Value> value;
    std::size_t bytes = 0;
  };

  const std::size_t max_bytes_;
  mutable Mutex mutex_;
  std::size_t bytes_ RELMAP_GUARDED_BY(mutex_) = 0;
  std::list<Kept> kept_ RELMAP_GUARDED_BY(mutex_);  // those used last first
  std::map<Key, typename std::list<Kept>::iterator> by_key_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::console
