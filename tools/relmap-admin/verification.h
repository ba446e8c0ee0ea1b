// Verification of an engine that is ours, map and journal.
#pragma once

#include <vector>

#include "storage/engine/engine.h"
#include "tools/relmap-admin/commands.h"

namespace relmap::admin {

// Findings are printed as they come. Of a whole map that is sound also whether it is the one whose hash was recorded in
// its folder. DEADLINE if interrupted.
Result<client::VerifySummary> verify_engine(const Context& context, const std::string& directory,
                                            const storage::Engine& engine, const std::vector<SessionNumber>& sessions);

}  // namespace relmap::admin
