// verify() for repair: it also reports what each wrong derived item should be.
#pragma once

#include "storage/maintenance/recount.h"
#include "storage/maintenance/verify.h"

namespace relmap::storage {

using OnDifference = std::function<void(const Difference&)>;

Result<VerifySummary> verify(const EngineSnapshot& snapshot, const VerifyOptions& options, const OnFinding& on_finding,
                             const OnProgress& on_progress, const OnDifference& on_difference);

}  // namespace relmap::storage
