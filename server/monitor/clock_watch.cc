#include "server/monitor/clock_watch.h"

#include <spdlog/spdlog.h>

#include <cmath>
#include <ctime>
#include <utility>

namespace relmap::monitor {

namespace {

double seconds_of(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double ahead(const ClockWatch::Times& times) { return times.day_s - times.steady_s; }

}  // namespace

ClockWatch::Times ClockWatch::system_clocks() { return {seconds_of(CLOCK_REALTIME), seconds_of(CLOCK_BOOTTIME)}; }

ClockWatch::ClockWatch(Clocks clocks) : clocks_(std::move(clocks)), ahead_s_(ahead(clocks_())) {}

bool ClockWatch::look() {
  const Times times = clocks_();
  const double step = ahead(times) - ahead_s_;
  ahead_s_ = ahead(times);
  if (std::abs(step) <= kStep_s) return false;
  last_step_s_ = step;
  last_step_at_s_ = times.steady_s;
  ++steps_;
  spdlog::warn("the system's clock was set {} by {:.1f} s; times of keyframes and in logs jump as much",
               step > 0 ? "forward" : "back", std::abs(step));
  return true;
}

double ClockWatch::last_step_age_s() const { return steps_ == 0 ? 0 : clocks_().steady_s - last_step_at_s_; }

}  // namespace relmap::monitor
