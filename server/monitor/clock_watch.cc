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
  const double now = ahead(clocks_());
  const double step = now - ahead_s_;
  ahead_s_ = now;
  if (std::abs(step) <= kStep_s) return false;
  last_step_s_ = step;
  ++steps_;
  spdlog::warn("the system's clock was set {} by {:.1f} s; times of keyframes and in logs jump as much",
               step > 0 ? "forward" : "back", std::abs(step));
  return true;
}

}  // namespace relmap::monitor
