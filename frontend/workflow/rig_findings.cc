#include "frontend/workflow/rig_findings.h"

#include <cstdio>
#include <string>

#include "frontend/vision/rig_check.h"

namespace relmap::workflow {

void tell_rig_findings(const frontend::RunSummary& summary, bool quiet) {
  for (const Status& finding : summary.findings())
    std::fprintf(stderr, "the eyes are not as the calibration says: %s\n",
                 vision::with_advice(finding).to_string().c_str());
  const auto& findings = summary.rig->findings;
  if (!quiet && !findings.empty() && findings[0].reason() == Reason::TOO_FEW_FEATURES)
    std::fprintf(stderr, "the eyes could not be checked: %s\n", findings[0].to_string().c_str());
}

Status refusal_of_rig(const frontend::RunSummary& summary) {
  std::string all;
  const auto findings = summary.findings();
  for (const Status& finding : findings)
    all += (all.empty() ? "" : "; " + std::string(reason_name(finding.reason())) + ": ") +
           vision::with_advice(finding).message();
  return {findings.front().reason(), all + "; --despite-check tracks it all the same"};
}

}  // namespace relmap::workflow
