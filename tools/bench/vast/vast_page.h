// The page of results of `relmap-bench vast`: what was measured, beside what the paper reports, with plots and the map.
#pragma once

#include "tools/bench/report.h"
#include "tools/bench/vast/vast_drive.h"
#include "tools/bench/vast/vast_judge.h"

namespace relmap::bench {

// Writes options.page, one HTML file with all pictures in it; options.picture is read if it exists. Throws StatusError
// (IO_ERROR).
void write_page(const VastOptions& options, const VastProgress& progress, const VastVerdict& verdict,
                const Report& report);

}  // namespace relmap::bench
