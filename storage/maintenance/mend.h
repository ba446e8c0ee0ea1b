// The second step of a repair, on the map as the worker edits it: references to what is lost are removed, sessions are
// joined again, and impossible numbers are replaced by the best that is known.
#pragma once

#include "storage/maintenance/repair.h"
#include "storage/map/map.h"

namespace relmap::storage {

// Edits `map`, and commits whenever `dirty_bytes` are dirty. The caller has to commit the last edits. Throws
// StatusError.
void mend_references(Map& map, std::size_t dirty_bytes, RepairSummary& summary, const OnFinding& told,
                     const OnProgress& on_progress);

}  // namespace relmap::storage
