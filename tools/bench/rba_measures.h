// What a relaxed map is worth: reprojection, consistency, counts.
#pragma once

#include <cstdint>

#include "storage/map/map.h"
#include "tests/support/simulated_drive.h"

namespace relmap::bench {

// The figure of eight with so many landmarks born in a frame.
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

// Of all observations in force, per coordinate, px.
double reprojection_rms(storage::Map& map);

// Mean normalised squared error against truth of chains of so many odometry edges, their covariances compounded; 6
// expected. The first and the newest edges are left out, whose covariances are not yet those of a solve.
double nees_of_chains(testing::SimulatedDrive& drive, std::uint32_t edges);

// Carrying edges with neither the support that moves them nor a prior.
std::uint32_t unsupported_edges(testing::SimulatedDrive& drive);
// In force or not.
std::uint64_t landmarks(testing::SimulatedDrive& drive);
// Of those, the ones that no closure has found to be another; and the points of the world that they stand for.
std::uint64_t landmarks_in_force(testing::SimulatedDrive& drive);
std::uint64_t points_seen(testing::SimulatedDrive& drive);

}  // namespace relmap::bench
