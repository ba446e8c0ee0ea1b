// Skipped sequences: those that are committed, and those that came since.
#pragma once

#include "storage/engine/engine.h"
#include "storage/graph/graph.h"
#include "storage/map/dirty_table.h"

namespace relmap::storage {

// As Graph::visit_skipped(). Throws StatusError (IO_ERROR, DATA_LOSS).
void visit_skipped(const EngineSnapshot& snapshot, const SkippedTable& since, SessionNumber session,
                   std::uint32_t sequence, const Graph::SkippedVisit& visit);

}  // namespace relmap::storage
