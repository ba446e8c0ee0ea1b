// A map of any size whose shape is known: sessions of robots that drive the streets of a city, with closures where one
// drives where another was before. It is made by storage's own API, without pictures.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "proto/geometry/geometry.h"
#include "storage/map/map.h"

namespace relmap::testing {

struct SkeletonCity {
  std::uint32_t frames = 1'000'000;  // of all sessions, a metre apart
  std::uint32_t frames_per_session = 2'000;
  std::uint32_t streets = 30;  // in each direction
  double closures = 0.3;       // share of the frames where another was before that get one
  std::uint64_t seed = 1;
};

// Where the robot of a session truly was, frame by frame: camera coordinates, z forward.
std::vector<SE3> true_way(const SkeletonCity& city, SessionNumber session);

// Adds to a map what it does not have yet of the city, and commits.
void build_city(const SkeletonCity& city, storage::Map& map);

// Makes the map in the data folder of a daemon, or what is missing of it.
void build_city_folder(const SkeletonCity& city, const std::string& folder);

}  // namespace relmap::testing
