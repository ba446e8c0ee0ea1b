// Threads that run handlers, so that no RPC blocks gRPC's own.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace relmap::rpc {

// Thread-safe. Tasks run in the order in which they were posted, each by one of the threads.
class TaskPool {
 public:
  explicit TaskPool(int threads);
  // Runs what was posted, then joins.
  ~TaskPool();
  TaskPool(const TaskPool&) = delete;
  TaskPool& operator=(const TaskPool&) = delete;

  void post(std::function<void()> task);

 private:
  void run();

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> tasks_;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace relmap::rpc
