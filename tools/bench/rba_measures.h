// Measures of a relaxed map: reprojection error, consistency, counts.
#pragma once

#include <cstdint>

#include "storage/map/map.h"
#include "tests/support/simulated_drive.h"

namespace relmap::bench {

// The figure of eight with `births` landmarks born in each frame.
inline sim::PointsWorldOptions figure8_world(int seed, double births) {
  sim::PointsWorldOptions world = sim::figure8_options(static_cast<std::uint64_t>(seed));
  world.births = births;
  return world;
}

inline rba::RbaOptions with_window(std::uint32_t frames) {
  rba::RbaOptions options;
  options.window = frames;
  return options;
}

// Root mean square reprojection error of all observations in force, per coordinate, px.
double reprojection_rms(storage::Map& map);

// Mean normalised squared error of chains of `edges` odometry edges against the truth, with compounded covariances; 6
// is expected. The first and the newest edges are left out, since their covariances are not yet those of a solve.
double nees_of_chains(testing::SimulatedDrive& drive, std::uint32_t edges);

// Edges of the graph with neither enough support to be adjusted nor a prior.
std::uint32_t unsupported_edges(testing::SimulatedDrive& drive);
// All landmarks, in force or not.
std::uint64_t landmarks(testing::SimulatedDrive& drive);
// The landmarks in force, and the number of points of the world that they represent.
std::uint64_t landmarks_in_force(testing::SimulatedDrive& drive);
std::uint64_t points_seen(testing::SimulatedDrive& drive);

}  // namespace relmap::bench
