// Checks the eyes of a live camera on its first pairs, on a thread of its own.
#pragma once

#include <functional>
#include <optional>
#include <thread>

#include "frontend/capture/first_pairs.h"
#include "proto/base/mutex.h"

namespace relmap::frontend {

class RigWatch {
 public:
  // `tell` is called once with the report, on the thread of the watch or by finish(). The rectifier must outlive the
  // watch.
  RigWatch(const vision::Rectifier& rectifier, std::function<void(const vision::RigReport&)> tell);
  ~RigWatch();

  // Offers a pair; to be called by one thread. Copies the pair if it is wanted and the thread is idle. Does not block.
  void offer(const capture::StereoFrame& raw);
  // Ends the watch: reports on the pairs so far if that has not been done. To be called once.
  void finish();

 private:
  void work();
  void stop();

  capture::FirstPairs first_;  // the thread's while busy_ is set, otherwise offer()'s
  std::function<void(const vision::RigReport&)> tell_;
  Mutex mutex_;
  ConditionVariable changed_;
  std::optional<capture::StereoFrame> frame_ RELMAP_GUARDED_BY(mutex_);  // the next one to check
  bool busy_ RELMAP_GUARDED_BY(mutex_) = false;
  bool told_ RELMAP_GUARDED_BY(mutex_) = false;
  bool stopping_ RELMAP_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace relmap::frontend
