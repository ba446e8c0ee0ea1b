// The exit codes of relmap-frontend.
#pragma once

#include "frontend/console.h"
#include "proto/base/status.h"

namespace relmap::workflow {

enum ExitCode {
  kDone = 0,
  kFailed = 1,
  kUsage = 2,      // wrong arguments
  kUnsettled = 3,  // keyframes are unsettled, were refused, or were given up as gaps
  kInterrupted = 4,
  kUntrusted = 5,  // not RunSummary::trusted()
};

// `status` is what run_frontend() returned. If several codes apply, 1 or 2 takes precedence, then 4, then 3, then 5.
ExitCode exit_code_of(const Status& status, const frontend::RunSummary& summary);

}  // namespace relmap::workflow
