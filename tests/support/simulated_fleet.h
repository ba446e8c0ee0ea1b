// Robots that drive the same circuit of one world, each with its own start, drive seed and light.
#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "storage/graph/graph.h"
#include "tests/support/drive_evaluation.h"
#include "tests/support/world_truth.h"

namespace relmap::testing {

inline constexpr std::array<const char*, 5> kFleetLights{"clear", "morning", "evening", "overcast", "dusk"};
inline constexpr int kFleetPairsALap = 100;

// Records one and a quarter laps of a robot, 10 pairs a second, in `folder`; returns the folder of the recording.
std::string record_fleet_robot(const std::string& folder, std::size_t robot);

// The truth of a recording in the frame of the world that the robots share.
DriveTruth read_fleet_truth(const std::string& recording);

struct FleetClosures {
  std::size_t accepted = 0, between_robots = 0;
  std::size_t wrong = 0;  // accepted, and off by more than is_wrong() allows with their covariance
  std::size_t vague = 0;  // accepted, and off by more than without it, as they say themselves
  std::size_t not_accepted = 0;
  void print() const;
};
FleetClosures closures_of(const storage::Graph& map, const WorldTruth& truth);

}  // namespace relmap::testing
