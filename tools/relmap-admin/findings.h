// Prints findings and progress of verify and repair.
#pragma once

#include "storage/maintenance/finding.h"
#include "tools/relmap-admin/commands.h"

namespace relmap::admin {

// Prints a finding as a line, or with --json as a document.
void print_finding(const Context& context, const storage::Finding& finding);

// Shows the progress of storage/maintenance on the bar. Returns false after an interrupt.
storage::OnProgress maintenance_progress(const Context& context);

}  // namespace relmap::admin
