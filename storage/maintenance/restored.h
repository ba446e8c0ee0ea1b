// Marks a map as restored from a backup.
#pragma once

#include <cstdint>

#include "proto/base/map_identity.h"
#include "storage/engine/engine.h"

namespace relmap::storage {

// For a copy of a map that no daemon works on: takes the engine over, and leaves it committed with the epoch `now_us`
// (microseconds UTC), or with the former epoch + 1 where that is later. From then on robots that know the map learn
// that it lacks what came after the backup. Returns the identity that the map has now. A map without an identity is
// left as it is, and an unknown identity is returned. IO_ERROR, DISK_FULL, STALE_OWNER; DATA_LOSS if the map's state
// cannot be read.
Result<MapIdentity> mark_restored(Engine& engine, std::uint64_t now_us);

}  // namespace relmap::storage
