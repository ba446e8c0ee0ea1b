// What is derived in a map (storage/graph/frame.h), worked out anew from the facts.
#pragma once

#include <cstddef>
#include <cstdint>

#include "proto/base/status.h"
#include "storage/engine/engine.h"
#include "storage/maintenance/finding.h"
#include "storage/map/map.h"

namespace relmap::storage {

// Puts right what is derived and is not as it should be, and commits: how many items there were. `map` is the engine's,
// as it was last committed, and nobody else works on it. Each item is told as a finding that was mended. Interrupted,
// it can be run again. IO_ERROR, STALE_OWNER; SHUTTING_DOWN if `on_progress` said so; INTERNAL if it did not help.
Result<std::uint64_t> rebuild_derived(Map& map, Engine& engine, std::size_t memory_bytes, const OnFinding& on_finding,
                                      const OnProgress& on_progress);

}  // namespace relmap::storage
