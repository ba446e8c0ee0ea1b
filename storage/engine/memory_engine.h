// An engine in memory whose content ends with the last reference to it: for unit tests and ThreadSanitizer.
#pragma once

#include <memory>

#include "storage/engine/engine.h"

namespace relmap::storage {

// A snapshot is an immutable map, so readers never lock. A commit copies the map of keys (not the values).
std::shared_ptr<Engine> make_memory_engine();

}  // namespace relmap::storage
