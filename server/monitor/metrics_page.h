// The page that Prometheus scrapes. docs/metrics.md lists what is on it; a test compares the list with this one.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "proto/base/mutex.h"
#include "server/rpc/core.h"
#include "storage/engine/engine.h"

namespace relmap::monitor {

// A family of metrics, all with a name of its own and the same labels.
struct MetricFamily {
  const char* name;
  const char* type;    // gauge, counter, histogram
  const char* labels;  // "component, reason"; empty: none
  const char* meaning;
};
const std::vector<MetricFamily>& metric_families();

// The table of docs/metrics.md.
std::string metrics_table();

class MetricsPage {
 public:
  // `folder`: the data folder; `low_water`: with fewer free bytes on its disk nothing is taken in. `core` must outlive
  // the page.
  MetricsPage(const rpc::Core& core, std::string folder, std::uint64_t low_water);

  // The page, in Prometheus' text format. Thread-safe. Nullopt if another thread is making it: a part of the daemon
  // may hang, and no more threads are to wait for it.
  std::optional<std::string> text();

 private:
  const storage::EngineStats& store();

  const rpc::Core& core_;
  const std::string folder_;
  const std::uint64_t low_water_;
  Mutex mutex_;
  bool making_ RELMAP_GUARDED_BY(mutex_) = false;
  // Of the thread that makes the page.
  storage::EngineStats store_;
  std::optional<std::chrono::steady_clock::time_point> store_read_;
};

}  // namespace relmap::monitor
