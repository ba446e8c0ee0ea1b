// A thread that does something again and again.
#pragma once

#include <chrono>
#include <functional>
#include <thread>

#include "proto/base/mutex.h"

namespace relmap::service {

class Periodic {
 public:
  // Calls `work` at once and then after each interval, until it is destroyed. An exception of `work` is logged.
  Periodic(std::chrono::milliseconds interval, std::function<void()> work);
  // Waits for the call that runs.
  ~Periodic();
  Periodic(const Periodic&) = delete;
  Periodic& operator=(const Periodic&) = delete;

  // Calls `work` once more soon.
  void hurry();

 private:
  void run();

  const std::chrono::milliseconds interval_;
  const std::function<void()> work_;
  Mutex mutex_;
  ConditionVariable changed_;
  bool stopping_ RELMAP_GUARDED_BY(mutex_) = false, hurried_ RELMAP_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace relmap::service
