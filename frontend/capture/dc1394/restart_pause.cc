#include "frontend/capture/dc1394/restart_pause.h"

#include <algorithm>

#include "proto/base/mutex.h"

namespace relmap::iidc::dc1394 {

void RestartPause::crashed(const Status& how, Clock::time_point now) {
  const MutexLock lock(mutex_);
  pause_ = now > last_ + kForgotten ? kFirst : std::clamp(2 * pause_, kFirst, kMax);
  last_ = now;
  how_ = how;
}

Status RestartPause::allows_start(Clock::time_point now) const {
  const MutexLock lock(mutex_);
  return now < last_ + pause_ ? how_ : Status();
}

}  // namespace relmap::iidc::dc1394
