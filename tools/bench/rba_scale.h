// What relative bundle adjustment costs as maps grow: at loops of any length, over many laps of one circuit, and over a
// drive that is far larger than memory.
#pragma once

#include <cstdint>
#include <string>

#include "tools/bench/report.h"

namespace relmap::bench {

struct ScaleOptions {
  std::uint32_t frames = 0;  // of the loop; a lap of the laps; of the exploration
  std::uint32_t laps = 1000;
  std::uint32_t window = 8;
  int seeds = 1;
  std::uint64_t memory_budget_mb = 256;  // of the exploration
  std::string data;                      // its folder; empty: a temporary one
  std::string picture;                   // file for one of the loop; empty: none
};

// One closing of a loop of `frames` frames, driven on for a window.
void run_loop(const ScaleOptions& options, Report& report);
// One circuit again and again: what the second lap costs, and the last.
void run_laps(const ScaleOptions& options, Report& report);
// A drive without loops, through the store: what its first tenth costs, and its last.
void run_exploration(const ScaleOptions& options, Report& report);

}  // namespace relmap::bench
