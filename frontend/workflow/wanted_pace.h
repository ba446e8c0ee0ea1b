// How many keyframes a second the daemon asks for at most, while it falls behind.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "proto/keyframe/ingest_messages.h"

namespace relmap::workflow {

// Thread-safe.
class WantedPace {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // It is said again while it holds; that it holds no more is said once, and may be lost: then it lasts no longer than
  // `lasts`.
  explicit WantedPace(std::chrono::milliseconds lasts) : lasts_(lasts) {}

  // Returns a line for people where that is something new.
  std::optional<std::string> hear(const PoseNews& news, Time now);
  void look(Time now);

  double hz() const { return wanted_hz_; }                  // keyframes; 0: as many as there are
  std::uint64_t slow_downs() const { return slow_downs_; }  // times that the daemon asked for fewer

 private:
  const std::chrono::milliseconds lasts_;
  std::atomic<double> wanted_hz_ = 0;
  std::atomic<Time> said_at_{};  // the last time
  std::atomic<std::uint64_t> slow_downs_ = 0;
};

}  // namespace relmap::workflow
