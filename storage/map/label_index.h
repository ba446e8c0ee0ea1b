// The index of labels: what is committed, with the changes made since.
#pragma once

#include <string>
#include <vector>

#include "storage/engine/engine.h"
#include "storage/map/dirty_table.h"

namespace relmap::storage {

// Both throw StatusError (IO_ERROR).
std::vector<FrameId> frames_labelled(const EngineSnapshot& snapshot, const LabelChanges& changes,
                                     const std::string& label);
std::vector<std::string> labels_beginning(const EngineSnapshot& snapshot, const LabelChanges& changes,
                                          const std::string& prefix);

}  // namespace relmap::storage
