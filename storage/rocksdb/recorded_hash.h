// DIR/HASH: the hash that a map had at one commit, written where a backup is made. The map in the folder may go on;
// then the file says nothing of it any more.
#pragma once

#include <optional>
#include <string>

#include "storage/engine/engine.h"
#include "storage/map/map.h"

namespace relmap::storage {

struct RecordedHash {
  std::uint64_t commit = 0;  // its number
  MapHash hash;
};

// Its name is durable only after sync_directory(). IO_ERROR.
Status write_recorded_hash(const std::string& directory, const RecordedHash& recorded);
// nullopt: there is none, or one that another version of the hash made. CORRUPT, IO_ERROR.
Result<std::optional<RecordedHash>> read_recorded_hash(const std::string& directory);

// Compares the map with what is recorded in its folder; false where nothing is recorded of this commit. DATA_LOSS: it
// is another map, or not all of it can be read, or the record is damaged. What `progress` answers, if not ok, ends it
// with just that.
Result<bool> agrees_with_recorded_hash(const std::string& directory, const EngineSnapshot& snapshot,
                                       const EngineProgress& progress);

}  // namespace relmap::storage
