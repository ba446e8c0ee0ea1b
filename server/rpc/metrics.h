// Metrics of every RPC: calls by method and outcome, and how long they took.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "proto/base/duration_histogram.h"
#include "proto/base/mutex.h"
#include "proto/base/reason.h"

namespace relmap::rpc {

struct MethodMetrics {
  double max_s = 0;                            // of all outcomes
  std::map<Reason, DurationCounts> durations;  // of finished calls, by outcome
};

// Thread-safe.
class Metrics {
 public:
  void count(std::string_view method, Reason outcome, double took_s) {
    const MutexLock lock(mutex_);
    auto found = methods_.find(method);
    if (found == methods_.end()) found = methods_.emplace(method, MethodMetrics()).first;
    found->second.max_s = std::max(found->second.max_s, took_s);
    found->second.durations[outcome].add(took_s);
  }
  using Methods = std::map<std::string, MethodMetrics, std::less<>>;
  Methods methods() const {
    const MutexLock lock(mutex_);
    return methods_;
  }

 private:
  mutable Mutex mutex_;
  Methods methods_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::rpc
