#include "server/rpc/task_pool.h"

#include "proto/base/mutex.h"

namespace relmap::rpc {

// Delegates so that the destructor ends the threads that run already if one cannot be started.
TaskPool::TaskPool(int threads) : TaskPool() {
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { run(); });
}

TaskPool::~TaskPool() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void TaskPool::post(std::function<void()> task) {
  {
    const MutexLock lock(mutex_);
    tasks_.push_back(std::move(task));
  }
  wake_.notify_one();
}

void TaskPool::run() {
  for (MutexLock lock(mutex_);;) {
    wake_.wait(mutex_, [this]() RELMAP_REQUIRES(mutex_) { return stopping_ || !tasks_.empty(); });
    if (tasks_.empty()) return;
    const std::function<void()> task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    task();
    lock.lock();
  }
}

}  // namespace relmap::rpc
