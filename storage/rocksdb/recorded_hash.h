// DIR/HASH: the hash that a map had at one commit, written when a backup is made. If the map in the folder goes on, the
// file says nothing about it any more.
#pragma once

#include <optional>
#include <string>

#include "storage/engine/engine.h"
#include "storage/map/map.h"

namespace relmap::storage {

struct RecordedHash {
  std::uint64_t commit = 0;  // number of the commit
  MapHash hash;
};

// Its name is durable only after sync_directory(). IO_ERROR.
Status write_recorded_hash(const std::string& directory, const RecordedHash& recorded);
// nullopt if there is none, or if another version of the hash made it. CORRUPT, IO_ERROR.
Result<std::optional<RecordedHash>> read_recorded_hash(const std::string& directory);

// Compares the map with the hash that is recorded in its folder. Returns false if none is recorded for this commit.
// DATA_LOSS: it is another map, or not all of it can be read, or the record is damaged. If `progress` returns a status
// other than OK, the comparison ends with that status.
Result<bool> agrees_with_recorded_hash(const std::string& directory, const EngineSnapshot& snapshot,
                                       const EngineProgress& progress);

}  // namespace relmap::storage
