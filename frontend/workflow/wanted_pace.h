// The maximum rate of keyframes that the daemon asks for while it falls behind.
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

  // A limit expires when it was not repeated for `lasts`. The daemon repeats a limit while it holds, but sends its end
  // only once, in a message that may be lost.
  explicit WantedPace(std::chrono::milliseconds lasts) : lasts_(lasts) {}

  // Takes in kSlowDown and kResume. Returns a line for the user when a limit begins or ends.
  std::optional<std::string> hear(const PoseNews& news, Time now);
  void look(Time now);  // drops a limit that has expired

  double hz() const { return wanted_hz_; }                  // keyframes a second; 0 if there is no limit
  std::uint64_t slow_downs() const { return slow_downs_; }  // number of limits, not counting repetitions

 private:
  const std::chrono::milliseconds lasts_;
  std::atomic<double> wanted_hz_ = 0;
  std::atomic<Time> said_at_{};  // when the limit was last heard
  std::atomic<std::uint64_t> slow_downs_ = 0;
};

}  // namespace relmap::workflow
