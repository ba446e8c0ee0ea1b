#include "frontend/rig_watch.h"

#include <utility>

#include "proto/base/mutex.h"

namespace relmap::frontend {

RigWatch::RigWatch(const vision::Rectifier& rectifier, std::function<void(const vision::RigReport&)> tell)
    : first_(rectifier), tell_(std::move(tell)), thread_([this] { work(); }) {}

RigWatch::~RigWatch() { stop(); }

void RigWatch::offer(const capture::StereoFrame& raw) {
  const MutexLock lock(mutex_);
  if (busy_ || told_ || !first_.wants(raw.time_us)) return;
  capture::StereoFrame copy;
  copy.left = vision::copy_of(raw.left);
  copy.right = vision::copy_of(raw.right);
  copy.time_us = raw.time_us;
  frame_ = std::move(copy);
  busy_ = true;
  changed_.notify_one();
}

void RigWatch::work() {
  MutexLock lock(mutex_);
  for (;;) {
    changed_.wait(mutex_, [this]() RELMAP_REQUIRES(mutex_) { return frame_ || stopping_; });
    if (!frame_) return;  // what was offered before the end is still checked
    capture::StereoFrame frame = std::move(*frame_);
    frame_.reset();
    lock.unlock();
    first_.take(std::move(frame));
    const bool enough = first_.enough();
    if (enough) tell_(first_.report());
    lock.lock();
    busy_ = false;
    told_ |= enough;
  }
}

void RigWatch::stop() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void RigWatch::finish() {
  stop();
  {
    const MutexLock lock(mutex_);
    if (std::exchange(told_, true)) return;
  }
  tell_(first_.report());
}

}  // namespace relmap::frontend
