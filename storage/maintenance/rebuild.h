// What is derived in a map (storage/frame.h), worked out anew from the facts.
#pragma once

#include <cstddef>
#include <cstdint>

#include "proto/status.h"
#include "storage/engine.h"
#include "storage/maintenance/finding.h"
#include "storage/map.h"

namespace relmap {

// Puts right what is derived and is not as it should be, and commits: how many items there were. `map` is the engine's,
// as it was last committed, and nobody else works on it. Each item is told as a finding that was mended. Interrupted,
// it can be run again. IO_ERROR, STALE_OWNER; SHUTTING_DOWN if `on_progress` said so; INTERNAL if it did not help.
Result<std::uint64_t> rebuild_derived(Map& map, Engine& engine, std::size_t memory_bytes, const OnFinding& on_finding,
                                      const OnProgress& on_progress);

}  // namespace relmap
