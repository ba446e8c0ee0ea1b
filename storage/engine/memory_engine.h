// The engine that forgets everything when its last holder does: unit tests, and TSan.
#pragma once

#include <memory>

#include "storage/engine/engine.h"

namespace relmap::storage {

// A snapshot is an immutable map, so readers never lock. A commit copies the map of keys (not the values).
std::shared_ptr<Engine> make_memory_engine();

}  // namespace relmap::storage
