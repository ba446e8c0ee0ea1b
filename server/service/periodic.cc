#include "server/service/periodic.h"

#include <spdlog/spdlog.h>

#include <utility>

#include "proto/base/status.h"

namespace relmap::service {

Periodic::Periodic(std::chrono::milliseconds interval, std::function<void()> work)
    : interval_(interval), work_(std::move(work)), thread_([this] { run(); }) {}

Periodic::~Periodic() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  thread_.join();
}

void Periodic::hurry() {
  const MutexLock lock(mutex_);
  hurried_ = true;
  changed_.notify_all();
}

void Periodic::run() {
  MutexLock lock(mutex_);
  while (!stopping_) {
    hurried_ = false;
    lock.unlock();
    try {
      work_();
    } catch (const std::exception&) {
      spdlog::error("{}", caught_status().to_string());
    }
    lock.lock();
    changed_.wait_for(mutex_, interval_, [this]() RELMAP_REQUIRES(mutex_) { return stopping_ || hurried_; });
  }
}

}  // namespace relmap::service
