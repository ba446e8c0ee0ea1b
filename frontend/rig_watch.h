// Checks the eyes of a live camera on the first pairs that come, beside everything else.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "frontend/capture/first_pairs.h"

namespace relmap::frontend {

class RigWatch {
 public:
  // `tell` is called once, by a thread of its own or by finish(). The rectifier must outlive it.
  RigWatch(const vision::Rectifier& rectifier, std::function<void(const vision::RigReport&)> tell);

  // By one thread. Copies those pairs that are wanted, while it has time for them, and never waits.
  void offer(const capture::StereoFrame& raw);
  // No more come: tells of those that came, if it has not yet. Once.
  void finish();

 private:
  void work(const std::stop_token& stop);

  capture::FirstPairs first_;
  std::function<void(const vision::RigReport&)> tell_;
  std::mutex mutex_;
  std::condition_variable_any came_;
  std::optional<capture::StereoFrame> frame_;  // to be looked at
  bool busy_ = false, told_ = false;
  std::jthread thread_;
};

}  // namespace relmap::frontend
