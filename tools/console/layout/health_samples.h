// How the daemon did in the last hour: a sample every five seconds, by a thread of its own.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <string>
#include <thread>

#include "proto/base/mutex.h"
#include "tools/console/layout/kept_client.h"

namespace relmap::console {

struct HealthSample {
  std::int64_t time_ms = 0;    // UTC
  bool reachable = false;      // false: the rest is not known
  double keyframes_per_s = 0;  // taken into the map since the sample before
  std::uint64_t frames = 0, queued = 0, lookup_lag = 0, pending_frames = 0;
  double relaxation_p50_us = 0, relaxation_p99_us = 0;
  std::uint64_t memory_used = 0, memory_budget = 0, resident_bytes = 0;
  std::uint64_t disk_bytes = 0;  // as of the last minute; 0: the console may not ask
  std::uint64_t refused = 0;
  std::uint64_t accepted = 0, candidate = 0, quarantined = 0, removed = 0;  // loop closures
};

struct HealthOptions {
  KeptClient::Connect connect;               // called again after a sample could not be taken
  KeptClient::Credentials credentials = {};  // that connect() shows
  std::chrono::milliseconds every{5000};
  std::size_t most = 720;       // samples
  std::size_t disk_every = 12;  // samples
};

// Thread-safe.
class HealthSamples {
 public:
  explicit HealthSamples(HealthOptions options);
  ~HealthSamples();
  HealthSamples(const HealthSamples&) = delete;
  HealthSamples& operator=(const HealthSamples&) = delete;

  void stop();  // ends the thread; what it has stays
  // The answer to /health/samples: those later than `since_ms`; `with_disk`: with disk_bytes, which the daemon tells
  // operators only.
  std::string samples_json(std::int64_t since_ms = 0, bool with_disk = true) const;
  std::deque<HealthSample> samples() const;

 private:
  void run();
  HealthSample take();

  const HealthOptions options_;
  mutable Mutex mutex_;
  ConditionVariable changed_;
  bool stopping_ RELMAP_GUARDED_BY(mutex_) = false;
  std::deque<HealthSample> samples_ RELMAP_GUARDED_BY(mutex_);

  // Of the thread.
  KeptClient client_;
  std::string boot_id_;
  std::uint64_t ingested_ = 0;
  std::chrono::steady_clock::time_point asked_{};
  std::uint64_t disk_bytes_ = 0;
  std::size_t taken_ = 0;

  std::thread thread_;
};

}  // namespace relmap::console
