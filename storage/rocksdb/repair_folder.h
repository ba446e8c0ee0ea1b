// Repair of a data folder from the files up: the store, then the journal, then the map (storage/maintenance/repair.h).
#pragma once

#include <string>

#include "storage/maintenance/repair.h"

namespace relmap::storage {

// FOLDER_LOCKED if a daemon owns the folder; DATA_LOSS if nothing of it can be saved; UNKNOWN_FORMAT_VERSION, IO_ERROR.
// What is broken is moved to DIR/quarantine/ and stays there until the operator deletes it. Interrupted at any point,
// it leaves a folder that is no worse than before and can be repaired by another run.
Result<RepairSummary> repair_folder(const std::string& directory, const RepairOptions& options,
                                    const OnFinding& on_finding, const OnProgress& on_progress);

}  // namespace relmap::storage
