// The first step of a repair, on the bytes as they are stored: what is broken goes to quarantine, what is whole beside
// it stays, and every frame that has a hot part gets the other parts too, empty ones in place of those that were lost.
// Afterwards the map can be opened like any other.
#pragma once

#include "storage/maintenance/quarantine.h"
#include "storage/maintenance/repair.h"

namespace relmap::storage {

// `told` is called for each thing that was mended. Every commit leaves a map that can be repaired again.
Status rewrite_broken_parts(Engine& engine, std::uint64_t epoch, Quarantine& quarantine, RepairSummary& summary,
                            const OnFinding& told, const OnProgress& on_progress);

}  // namespace relmap::storage
