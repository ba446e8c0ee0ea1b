// Threads that run handlers, so that no RPC blocks a thread of gRPC.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <thread>
#include <vector>

#include "proto/base/mutex.h"

namespace relmap::rpc {

// Tasks start in the order in which they were posted, each on one of the threads. Thread-safe.
class TaskPool {
 public:
  explicit TaskPool(int threads);
  // Runs all tasks that were posted, then joins the threads.
  ~TaskPool();
  TaskPool(const TaskPool&) = delete;
  TaskPool& operator=(const TaskPool&) = delete;

  void post(std::function<void()> task);

 private:
  TaskPool() = default;
  void run();

  Mutex mutex_;
  ConditionVariable wake_;
  std::deque<std::function<void()>> tasks_ RELMAP_GUARDED_BY(mutex_);
  bool stopping_ RELMAP_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_;
};

}  // namespace relmap::rpc
