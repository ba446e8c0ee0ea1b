// What a relaxed map is worth: reprojection, consistency, counts.
#pragma once

#include <cstdint>

#include "storage/map.h"
#include "tests/simulated_drive.h"

namespace relmap::bench {

// Of all observations in force, per coordinate, px.
double reprojection_rms(Map& map);

struct EdgeConsistency {
  double nees_mean = 0;  // normalised squared error of odometry edges against truth; 6 expected
  std::uint32_t edges = 0;
};
// Edges from frame `first` on; the newest are left out, whose covariance is not yet that of a solve.
EdgeConsistency edge_consistency(SimulatedDrive& drive, std::uint32_t first = 10);

// Carrying edges with neither the support that moves them nor a prior.
std::uint32_t unsupported_edges(SimulatedDrive& drive);
// In force or not.
std::uint64_t landmarks(SimulatedDrive& drive);

}  // namespace relmap::bench
