// Verifies map and journal of an engine that this process has opened.
#pragma once

#include <vector>

#include "storage/engine/engine.h"
#include "tools/relmap-admin/commands.h"

namespace relmap::admin {

// Verifies the given sessions (empty: all) and prints each finding at once. If a whole map is sound, also compares it
// with the hash that is recorded in its folder, if there is one. DEADLINE after an interrupt.
Result<client::VerifySummary> verify_engine(const Context& context, const std::string& directory,
                                            const storage::Engine& engine, const std::vector<SessionNumber>& sessions);

}  // namespace relmap::admin
