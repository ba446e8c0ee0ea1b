// relmapd that is killed and started again: what its processes cost together.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <memory>
#include <utility>
#include <vector>

#include "tests/support/running_daemon.h"
#include "tools/bench/fleet/deeds.h"

namespace relmap::bench {

class KilledDaemon {
 public:
  explicit KilledDaemon(testing::DaemonOptions options, std::chrono::milliseconds patience = testing::kPatience)
      : options_(std::move(options)), patience_(patience) {
    start();
  }

  // kill -9, and up again. Returns when the new process was started.
  std::int64_t restart() {
    note();
    cpu_before_ += running_->process().cpu_seconds();
    running_->process().kill();
    const std::int64_t at = monotonic_ns();
    start();
    return at;
  }
  void stop() {
    note();
    if (running_->stop() != 0) std::cerr << "relmapd did not stop as it should: " << running_->log() << '\n';
  }
  double cpu() const { return cpu_before_ + running_->process().cpu_seconds(); }
  double peak_resident_mb() {
    note();
    return static_cast<double>(peak_resident_) / (1 << 20);
  }
  // Seconds from each start until it served.
  const std::vector<double>& starts_s() const { return starts_s_; }
  testing::RunningDaemon& running() { return *running_; }

 private:
  void start() {
    running_.reset();
    const std::int64_t begin_ns = monotonic_ns();
    running_ = std::make_unique<testing::RunningDaemon>(options_, patience_);
    starts_s_.push_back(1e-9 * static_cast<double>(monotonic_ns() - begin_ns));
    std::cerr << "relmapd serves after " << starts_s_.back() << " s\n";
  }
  void note() { peak_resident_ = std::max(peak_resident_, running_->process().peak_resident_bytes()); }

  const testing::DaemonOptions options_;
  const std::chrono::milliseconds patience_;
  std::unique_ptr<testing::RunningDaemon> running_;
  double cpu_before_ = 0;
  std::size_t peak_resident_ = 0;
  std::vector<double> starts_s_;
};

}  // namespace relmap::bench
