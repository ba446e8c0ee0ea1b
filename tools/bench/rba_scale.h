// The cost of relative bundle adjustment in growing maps: at loops of any length, over many laps of one circuit, and
// over a drive that is far larger than memory.
#pragma once

#include <cstdint>
#include <string>

#include "tools/bench/report.h"

namespace relmap::bench {

struct ScaleOptions {
  std::uint32_t frames = 0;  // of the loop, of a lap, or of the exploration
  std::uint32_t laps = 1000;
  std::uint32_t window = 8;
  int seeds = 1;
  std::uint64_t memory_budget_mb = 256;  // of the exploration
  std::string data;                      // its folder; empty: a temporary one
  std::string picture;                   // file for a plot; empty: none
};

// Closes a loop of `frames` frames once, and drives on for a window.
void run_loop(const ScaleOptions& options, Report& report);
// Drives one circuit again and again: the cost of the second and of the last lap.
void run_laps(const ScaleOptions& options, Report& report);
// Drives without loops, through the store: the cost of the first and of the last tenth.
void run_exploration(const ScaleOptions& options, Report& report);

}  // namespace relmap::bench
