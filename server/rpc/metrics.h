// Metrics of every RPC: calls, time, and refusals by reason.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <string>

#include "proto/base/mutex.h"
#include "proto/base/reason.h"

namespace relmap::rpc {

struct MethodMetrics {
  std::uint64_t calls = 0;  // finished
  std::uint64_t total_us = 0;
  std::uint64_t max_us = 0;
  std::map<Reason, std::uint64_t> failures;
};

// Thread-safe.
class Metrics {
 public:
  void count(const std::string& method, Reason outcome, std::chrono::microseconds took) {
    const MutexLock lock(mutex_);
    MethodMetrics& m = methods_[method];
    ++m.calls;
    const auto us = static_cast<std::uint64_t>(took.count());
    m.total_us += us;
    m.max_us = std::max(m.max_us, us);
    if (outcome != Reason::OK) ++m.failures[outcome];
  }
  std::map<std::string, MethodMetrics> methods() const {
    const MutexLock lock(mutex_);
    return methods_;
  }

 private:
  mutable Mutex mutex_;
  std::map<std::string, MethodMetrics> methods_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::rpc
