// A drive with rides through the front-end and into a map, as robot and daemon would, in this process.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "proto/keyframe/keyframe.h"
#include "server/map/mapper.h"
#include "tools/sim/picture_world.h"

namespace relmap::bench {

// What the front-end made of it, and what is true of its keyframes.
struct RideDrive {
  std::vector<Keyframe> keyframes;  // complete
  std::vector<SE3> truth;           // T_world_left of each
  std::vector<char> riding;         // it stood in what carries it, or would
  std::vector<char> carried;        // and that moved
  std::uint32_t pairs = 0, lost = 0;
};
// Pictures are rendered, tracked and described. Throws StatusError.
RideDrive drive_ride(const sim::PictureWorldOptions& options);

// By a deterministic mapper over the memory engine; with the vocabulary that is shipped, or without closures. Throws
// StatusError.
std::unique_ptr<map::Mapper> map_ride(const RideDrive& drive, bool closures);

}  // namespace relmap::bench
