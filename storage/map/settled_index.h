// What was settled without a frame: what is committed, with what came since behind it.
#pragma once

#include "storage/engine/engine.h"
#include "storage/graph/graph.h"
#include "storage/map/dirty_table.h"

namespace relmap::storage {

// As Graph::visit_settled(). Throws StatusError (IO_ERROR, DATA_LOSS).
void visit_settled(const EngineSnapshot& snapshot, const SettledTable& since, SessionNumber session,
                   std::uint32_t sequence, const Graph::SettledVisit& visit);

}  // namespace relmap::storage
