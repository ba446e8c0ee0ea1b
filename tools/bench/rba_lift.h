// Motion that the robot cannot sense, by train or lift: its camera sees the cabin stand still while both move.
// Afterwards it closes a loop, so that no single global frame fits the measurements.
#pragma once

#include <cstdint>
#include <string>

#include "tools/bench/report.h"

namespace relmap::bench {

struct LiftOptions {
  std::uint32_t window = 8;
  int seeds = 1;
  std::string picture;  // of the train: error by keyframe; empty: none
};

void run_lift(const LiftOptions& options, Report& report);

}  // namespace relmap::bench
