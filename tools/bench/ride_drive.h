// Runs a drive with rides through the front-end and into a map in this process, as robot and daemon would.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "proto/keyframe/keyframe.h"
#include "server/map/mapper.h"
#include "tools/sim/picture_world.h"

namespace relmap::bench {

// The keyframes that the front-end made, with their truth.
struct RideDrive {
  std::vector<Keyframe> keyframes;  // complete
  std::vector<SE3> truth;           // T_world_left of each
  std::vector<char> riding;         // the robot was in the carrier, or would be
  std::vector<char> carried;        // the carrier moved
  std::uint32_t pairs = 0, lost = 0;
};
// Renders the pictures and runs the front-end on them. Throws StatusError.
RideDrive drive_ride(const sim::PictureWorldOptions& options);

// Opens a deterministic mapper over the memory engine for the drive, with the shipped vocabulary or without closures,
// and begins its session, number 1. take_in() adds keyframe i, and returns once what follows from it is done. Throw
// StatusError.
std::unique_ptr<map::Mapper> begin_ride(const RideDrive& drive, bool closures);
void take_in(const RideDrive& drive, std::size_t i, map::Mapper& mapper);
// The same for the whole drive.
std::unique_ptr<map::Mapper> map_ride(const RideDrive& drive, bool closures);

}  // namespace relmap::bench
