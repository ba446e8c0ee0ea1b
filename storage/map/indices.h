// The indices that have keys of their own, of labels and of skipped sequences: what is committed, with the changes made
// since.
#pragma once

#include <string>
#include <vector>

#include "storage/engine/engine.h"
#include "storage/graph/graph.h"
#include "storage/map/dirty_table.h"

namespace relmap::storage {

// Both throw StatusError (IO_ERROR).
std::vector<FrameId> frames_labelled(const EngineSnapshot& snapshot, const LabelChanges& changes,
                                     const std::string& label);
std::vector<std::string> labels_beginning(const EngineSnapshot& snapshot, const LabelChanges& changes,
                                          const std::string& prefix);

// As Graph::visit_skipped(). Throws StatusError (IO_ERROR, DATA_LOSS).
void visit_skipped(const EngineSnapshot& snapshot, const SkippedTable& since, SessionNumber session,
                   std::uint32_t sequence, const Graph::SkippedVisit& visit);

}  // namespace relmap::storage
