// Verify, Backup and Compact, one at a time: two of them would halve each other's disk and double the memory held.
#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "proto/base/status.h"

namespace relmap::rpc {

// Thread-safe.
class MaintenanceTurn {
 public:
  // Held for as long as the work goes on.
  using Held = std::shared_ptr<const void>;

  // BUDGET_EXCEEDED, naming the work under way.
  Result<Held> take(const std::string& work) {
    const std::lock_guard lock(mutex_);
    if (!under_way_.empty())
      return Status(Reason::BUDGET_EXCEEDED, work + ": " + under_way_ + " is under way, and one at a time is enough");
    under_way_ = work;
    return Held(this, [this](const void*) {
      const std::lock_guard ended(mutex_);
      under_way_.clear();
    });
  }

 private:
  std::mutex mutex_;
  std::string under_way_;
};

}  // namespace relmap::rpc
