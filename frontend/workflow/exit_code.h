// What relmap-frontend's exit code says of a run.
#pragma once

#include "frontend/console.h"
#include "proto/base/status.h"

namespace relmap::workflow {

enum ExitCode {
  kDone = 0,
  kFailed = 1,
  kUsage = 2,      // what was asked for is wrong
  kUnsettled = 3,  // keyframes are left, were refused or given up
  kInterrupted = 4,
  kUntrusted = 5,  // RunSummary::trusted()
};

// `status`: what run_frontend() returned. 1, 2 and 4 go before 3, and 3 before 5.
ExitCode exit_code_of(const Status& status, const frontend::RunSummary& summary);

}  // namespace relmap::workflow
