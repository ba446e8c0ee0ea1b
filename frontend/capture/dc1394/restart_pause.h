// Limits how soon a process that crashes is started again: at once after the first crash, with growing pauses if it
// continues to crash.
#pragma once

#include <chrono>

#include "proto/base/mutex.h"
#include "proto/base/status.h"

namespace relmap::iidc::dc1394 {

// Thread-safe.
class RestartPause {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kFirst{100}, kMax{2000};
  static constexpr std::chrono::seconds kForgotten{10};  // after this time without a crash the pause is reset

  void crashed(const Status& how, Clock::time_point now = Clock::now());
  // CAMERA_GONE, with the cause of the crash, if the process must not be started yet.
  Status allows_start(Clock::time_point now = Clock::now()) const;

 private:
  mutable Mutex mutex_;
  std::chrono::milliseconds pause_ RELMAP_GUARDED_BY(mutex_){0};
  Clock::time_point last_ RELMAP_GUARDED_BY(mutex_){};
  Status how_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::iidc::dc1394
