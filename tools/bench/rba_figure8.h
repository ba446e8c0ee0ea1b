// The figure of eight of docs/method.md, 5: the cost of a keyframe, and the accuracy of the adaptive solution compared
// with the full one and with a sliding window by Ceres.
#pragma once

#include <cstdint>
#include <string>

#include "tools/bench/report.h"

namespace relmap::bench {

struct Figure8Options {
  std::uint32_t window = 8;
  int seeds = 1;
  double births = 11.1;  // landmarks born in a frame
  bool full = true;      // compare with the full solution
  std::string picture;   // empty: none
};

// Time of an update, by keyframe (paper, Figure 12).
void run_figure8(const Figure8Options& options, Report& report);
// Registration error by the size of the region that a new keyframe activates (paper, Figure 14).
void run_regions(const Figure8Options& options, Report& report);

}  // namespace relmap::bench
