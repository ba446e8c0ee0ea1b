// Motion that the robot cannot sense: a train, a lift. Its camera sees the cabin stand still while both move, and
// afterwards it closes a loop, so that no one global frame fits what was measured.
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
