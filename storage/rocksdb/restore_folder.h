// A data folder from a backup, on another disk or on the same.
#pragma once

#include <cstdint>
#include <string>

#include "proto/base/map_identity.h"
#include "storage/engine/engine.h"

namespace relmap::storage {

struct Restored {
  MapIdentity map;  // with the epoch of this restore; not known: the map had no identity yet
  Status unmarked;  // not ok: why it passes for the map that was backed up (its state is damaged)
};

// Copies what makes up the map in the folder `backup`, which no process may own; the copy shares nothing with it. `to`
// must not exist or be empty, nor lie in `backup` or hold it, and appears when it is complete and durable, with its
// epoch raised (mark_restored()) to `now_us`, microseconds UTC. The bytes are copied as they are: verify before, where
// it matters. NO_SUCH_FILE: there is no map. FOLDER_LOCKED, INVALID_ARGUMENT, IO_ERROR, DISK_FULL.
Result<Restored> restore_folder(const std::string& backup, const std::string& to, std::uint64_t now_us,
                                const EngineProgress& progress);

}  // namespace relmap::storage
