// Computes what is derived in a map (storage/graph/frame.h) anew from the facts.
#pragma once

#include <cstddef>
#include <cstdint>

#include "proto/base/status.h"
#include "storage/engine/engine.h"
#include "storage/maintenance/finding.h"
#include "storage/map/map.h"

namespace relmap::storage {

// Corrects what is derived and is not as it should be, commits, and returns the number of items corrected. `map` must
// be that of `engine`, as it was last committed, and nobody else may work on it. Each item is reported as a finding
// that was repaired. If interrupted, it can be run again. IO_ERROR, STALE_OWNER; SHUTTING_DOWN if `on_progress` said
// so; INTERNAL if something is still wrong afterwards.
Result<std::uint64_t> rebuild_derived(Map& map, Engine& engine, std::size_t memory_bytes, const OnFinding& on_finding,
                                      const OnProgress& on_progress);

}  // namespace relmap::storage
