// Says of a map that it was restored from a backup.
#pragma once

#include <cstdint>

#include "proto/base/map_identity.h"
#include "storage/engine/engine.h"

namespace relmap::storage {

// A copy of a map that no daemon works on: takes the engine over, and leaves it committed with an epoch of `now_us`, or
// 1 after the one before where that is later. From then on robots that know the map learn that it lacks what came after
// the backup. Returns the identity that it has now; one that is not known where the map has none yet: nothing is
// changed then. IO_ERROR, DISK_FULL, STALE_OWNER; DATA_LOSS if the map's state cannot be read.
Result<MapIdentity> mark_restored(Engine& engine, std::uint64_t now_us);

}  // namespace relmap::storage
