// The output of `relmap top`: the daemon and its robots at one moment, with rates since the previous moment.
#pragma once

#include <chrono>
#include <optional>
#include <vector>

#include "client/map_types.h"
#include "tools/terminal/console.h"

namespace relmap::cli {

struct TopMoment {
  std::chrono::steady_clock::time_point at;
  client::DaemonStatus status;
  std::vector<client::RobotStatus> robots;
  std::vector<client::Session> sessions;
};

struct TopLimits {
  std::size_t robots = 40, sessions = 10;  // rows at most; the rest is counted
};

// Lists robots in trouble first, and sessions by the time of their newest frame, newest first.
void print_top(const TopMoment& now, const std::optional<TopMoment>& before, const TopLimits& limits,
               terminal::Console& console);

}  // namespace relmap::cli
