// What `relmap top` shows: the daemon and its robots at one moment, and how fast it works since the moment before.
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
  std::size_t robots = 40, sessions = 10;  // rows; the rest is counted
};

// Robots in trouble first, then by name; sessions that grew last first.
void print_top(const TopMoment& now, const std::optional<TopMoment>& before, const TopLimits& limits,
               terminal::Console& console);

}  // namespace relmap::cli
