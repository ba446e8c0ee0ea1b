// The relative solution against the Euclidean one, by Ceres to convergence: on the simulated figure eight (paper,
// Figure 16), and on recorded stereo measurements.
#pragma once

#include <cstdint>
#include <string>

#include "tools/bench/report.h"

namespace relmap::bench {

struct EuclideanOptions {
  std::uint32_t window = 8;
  int seeds = 1;
  double births = 0;    // landmarks born in a frame
  std::string data;     // folder of the data sets
  std::string picture;  // empty: none
};

void run_euclidean(const EuclideanOptions& options, Report& report);
// Throws StatusError (NO_SUCH_FILE) where a data set is not there.
void run_real(const EuclideanOptions& options, Report& report);

}  // namespace relmap::bench
