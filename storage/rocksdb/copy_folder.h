// A data folder's copy on another disk, or back from one.
#pragma once

#include <string>

#include "storage/engine.h"

namespace relmap {

// Copies what makes up the map in the data folder `from`, which no process may own; the copy shares nothing with it.
// `to` must not exist or be empty, nor lie in `from` or hold it, and appears when it is complete and durable. The bytes
// are copied as they are: verify before, where it matters. NO_SUCH_FILE: there is no map. FOLDER_LOCKED,
// INVALID_ARGUMENT, IO_ERROR.
Status copy_folder(const std::string& from, const std::string& to, const EngineProgress& progress);

}  // namespace relmap
