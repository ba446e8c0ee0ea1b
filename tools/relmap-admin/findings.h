// Verifies an engine, and prints findings and progress of verify and repair.
#pragma once

#include <string>
#include <vector>

#include "storage/engine/engine.h"
#include "storage/maintenance/finding.h"
#include "tools/relmap-admin/commands.h"

namespace relmap::admin {

// Prints a finding as a line, or with --json as a document.
void print_finding(const Context& context, const storage::Finding& finding);

// Shows the progress of storage/maintenance on the bar. Returns false after an interrupt.
storage::OnProgress maintenance_progress(const Context& context);

// Verifies map and journal of an engine that this process has opened, of the given sessions (empty: all), and prints
// each finding at once. If a whole map is sound, also compares it with the hash that is recorded in its folder, if
// there is one. DEADLINE after an interrupt.
Result<client::VerifySummary> verify_engine(const Context& context, const std::string& directory,
                                            const storage::Engine& engine, const std::vector<SessionNumber>& sessions);

}  // namespace relmap::admin
