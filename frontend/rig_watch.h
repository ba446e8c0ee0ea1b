// Checks the eyes of a live camera on the first pairs that come, beside everything else.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "frontend/capture/first_pairs.h"

namespace relmap {

class RigWatch {
 public:
  // `tell` is called once, by a thread of its own or by finish(). The rectifier must outlive it.
  RigWatch(const Rectifier& rectifier, std::function<void(const RigReport&)> tell);

  // By one thread. Copies those pairs that are wanted, while it has time for them, and never waits.
  void offer(const StereoFrame& raw);
  // No more come: tells of those that came, if it has not yet. Once.
  void finish();

 private:
  void work(const std::stop_token& stop);

  FirstPairs first_;
  std::function<void(const RigReport&)> tell_;
  std::mutex mutex_;
  std::condition_variable_any came_;
  std::optional<StereoFrame> frame_;  // to be looked at
  bool busy_ = false, told_ = false;
  std::jthread thread_;
};

}  // namespace relmap
