// The hash of a map (storage/map/map.h) as it stands in a snapshot, in bounded memory.
#pragma once

#include <cstdint>
#include <functional>

#include "storage/engine/engine.h"
#include "storage/map/map.h"

namespace relmap::storage {

// `progress` is called with the frames done and the number of frames that the sessions have. If it returns a status
// other than OK, the hash ends with that status. DATA_LOSS naming what cannot be read.
Result<MapHash> hash_stored(const EngineSnapshot& snapshot,
                            const std::function<Status(std::uint64_t done, std::uint64_t total)>& progress);

}  // namespace relmap::storage
