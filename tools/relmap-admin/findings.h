// Findings as the user sees them.
#pragma once

#include "storage/maintenance/finding.h"
#include "tools/relmap-admin/commands.h"

namespace relmap::admin {

// A line, or with --json a document.
void print_finding(const Context& context, const storage::Finding& finding);

// Of long work of storage/maintenance; false once interrupted.
storage::OnProgress maintenance_progress(const Context& context);

}  // namespace relmap::admin
