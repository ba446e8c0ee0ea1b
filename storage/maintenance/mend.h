// The second step of a repair, on the map as the worker edits it: what refers to something lost lets go of it, sessions
// hang together again, and numbers that cannot be are replaced by the best that is known.
#pragma once

#include "storage/maintenance/repair.h"
#include "storage/map/map.h"

namespace relmap::storage {

// Edits `map`, and commits whenever `dirty_bytes` are reached; the last edits are the caller's to commit. Throws
// StatusError.
void mend_references(Map& map, std::size_t dirty_bytes, RepairSummary& summary, const OnFinding& told,
                     const OnProgress& on_progress);

}  // namespace relmap::storage
