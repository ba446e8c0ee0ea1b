// Makes a data folder from a backup, on the same disk or another.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "proto/base/map_identity.h"
#include "storage/engine/engine.h"

namespace relmap::storage {

struct Restored {
  MapIdentity map;  // with the epoch of this restore; unknown if the map had no identity yet
  Status unmarked;  // not OK: why the copy passes for the map that was backed up (its state is damaged)
};

// Called with the folder of the copy, once it is whole and before anything in it is changed. If it returns a status
// other than OK, nothing is restored.
using CheckCopy = std::function<Status(const std::string& copy)>;

// Copies the map in the folder `backup`, which no process may own; nothing in `backup` is written, and the copy shares
// nothing with it. `to` must be
// missing or empty, and must not lie in `backup` or contain it. It appears when it is complete and durable, with its
// epoch raised to `now_us`, microseconds UTC. Numbers of new sessions begin 2^20 above those of the backup. The bytes
// are copied unchecked: verify them before, or by `check`, where it matters. NO_SUCH_FILE: there is no map.
// FOLDER_LOCKED, INVALID_ARGUMENT, IO_ERROR, DISK_FULL.
Result<Restored> restore_folder(const std::string& backup, const std::string& to, std::uint64_t now_us,
                                const EngineProgress& progress, const CheckCopy& check = {});

}  // namespace relmap::storage
