// The identity of a map, for the tests of what a robot accepts as its map.
#pragma once

#include "proto/base/map_identity.h"

namespace relmap::publishing::testing_map {

inline MapIdentity map_of(std::uint8_t name, std::uint64_t epoch = 1) {
  MapIdentity map;
  map.uuid.bytes.fill(name);
  map.epoch = epoch;
  return map;
}

}  // namespace relmap::publishing::testing_map
