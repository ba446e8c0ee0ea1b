// Checks the eyes of a live camera on its first pairs, on a thread of its own.
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
  // `tell` is called once with the report, on the thread of the watch or by finish(). The rectifier must outlive the
  // watch.
  RigWatch(const vision::Rectifier& rectifier, std::function<void(const vision::RigReport&)> tell);

  // Offers a pair; to be called by one thread. Copies the pair if it is wanted and the thread is idle. Does not block.
  void offer(const capture::StereoFrame& raw);
  // Ends the watch: reports on the pairs so far if that has not been done. To be called once.
  void finish();

 private:
  void work(const std::stop_token& stop);

  capture::FirstPairs first_;
  std::function<void(const vision::RigReport&)> tell_;
  std::mutex mutex_;
  std::condition_variable_any came_;
  std::optional<capture::StereoFrame> frame_;  // the next one to check
  bool busy_ = false, told_ = false;
  std::jthread thread_;
};

}  // namespace relmap::frontend
