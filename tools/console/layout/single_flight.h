// What several threads ask for at a time is made by the first of them, and the others wait for it.
#pragma once

#include <exception>
#include <functional>
#include <future>
#include <map>

#include "proto/base/mutex.h"

namespace relmap::console {

// Thread-safe. Keeps nothing: who comes later has it made anew.
template <typename Key, typename Value>
class SingleFlight {
 public:
  // What `make` returns or throws, or what that of another thread does which runs for this key.
  Value get(const Key& key, const std::function<Value()>& make) {
    std::promise<Value> made;
    bool first = false;
    std::shared_future<Value> flight;
    {
      const MutexLock lock(mutex_);
      const auto [at, added] = flights_.try_emplace(key);
      if (added) at->second = made.get_future().share();
      first = added;
      flight = at->second;
    }
    if (first) {
      try {
        made.set_value(make());
      } catch (...) {
        made.set_exception(std::current_exception());
      }
      const MutexLock lock(mutex_);
      flights_.erase(key);
    }
    return flight.get();
  }

 private:
  Mutex mutex_;
  std::map<Key, std::shared_future<Value>> flights_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::console
