#include "frontend/workflow/exit_code.h"

#include "frontend/publishing/publisher.h"

namespace relmap::workflow {

ExitCode exit_code_of(const Status& status, const frontend::RunSummary& summary) {
  const bool misused = status.reason() == Reason::INVALID_ARGUMENT || status.reason() == Reason::NO_SUCH_SESSION ||
                       status.reason() == Reason::BAD_NAME;
  if (!status.ok()) return misused ? kUsage : kFailed;
  if (summary.interrupted) return kInterrupted;
  const publishing::PublishSummary& published = summary.publishing;
  if (!published.all_settled() || !published.refused.empty() || published.gaps > 0) return kUnsettled;
  return summary.trusted() ? kDone : kUntrusted;
}

}  // namespace relmap::workflow
