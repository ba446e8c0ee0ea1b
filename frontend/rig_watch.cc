#include "frontend/rig_watch.h"

#include <utility>

namespace relmap::frontend {

RigWatch::RigWatch(const vision::Rectifier& rectifier, std::function<void(const vision::RigReport&)> tell)
    : first_(rectifier), tell_(std::move(tell)), thread_([this](const std::stop_token& stop) { work(stop); }) {}

void RigWatch::offer(const capture::StereoFrame& raw) {
  const std::lock_guard lock(mutex_);
  if (busy_ || told_ || !first_.wants(raw.time_us)) return;
  capture::StereoFrame copy;
  copy.left = vision::copy_of(raw.left);
  copy.right = vision::copy_of(raw.right);
  copy.time_us = raw.time_us;
  frame_ = std::move(copy);
  busy_ = true;
  came_.notify_one();
}

void RigWatch::work(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (came_.wait(lock, stop, [&] { return frame_.has_value(); })) {
    capture::StereoFrame frame = std::move(*frame_);
    frame_.reset();
    lock.unlock();
    first_.take(std::move(frame));  // offer() does not use first_ while busy_ is set
    const bool enough = first_.enough();
    if (enough) tell_(first_.report());
    lock.lock();
    busy_ = false;
    told_ |= enough;
  }
}

void RigWatch::finish() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
  if (!std::exchange(told_, true)) tell_(first_.report());
}

}  // namespace relmap::frontend
