// Lets Verify, Backup and Compact run one at a time, since two would halve each other's disk throughput and double the
// memory.
#pragma once

#include <memory>
#include <string>

#include "proto/base/mutex.h"
#include "proto/base/status.h"

namespace relmap::rpc {

// Thread-safe.
class MaintenanceTurn {
 public:
  // Must be held as long as the work runs.
  using Held = std::shared_ptr<const void>;

  // Takes the turn for `work`. BUDGET_EXCEEDED, with the name of the work that is running, if there is one.
  Result<Held> take(const std::string& work) {
    const MutexLock lock(mutex_);
    if (!under_way_.empty())
      return Status(Reason::BUDGET_EXCEEDED, work + ": " + under_way_ + " is running, and only one may run at a time");
    under_way_ = work;
    return Held(this, [this](const void*) {
      const MutexLock ended(mutex_);
      under_way_.clear();
    });
  }

 private:
  Mutex mutex_;
  std::string under_way_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::rpc
