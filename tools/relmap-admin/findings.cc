#include "tools/relmap-admin/findings.h"

#include "tools/relmap-admin/target.h"

namespace relmap::admin {

void print_finding(const Context& context, const Finding& finding) {
  const std::string reason(reason_name(finding.reason));
  const std::string frame = finding.frame.session == 0 ? "" : finding.frame.to_string();
  context.say(reason + "  " + (frame.empty() ? "" : "frame " + frame + ": ") + finding.what +
              (finding.repaired ? "  (mended)" : ""));
  cli::Json json;
  json.add("reason", reason).add("frame", frame).add("message", finding.what).add("repaired", finding.repaired);
  context.console.reply(cli::Json().add("finding", json).text());
}

OnProgress maintenance_progress(const Context& context) {
  return [&context](const MaintenanceProgress& progress) {
    context.show(progress.step, progress.done, progress.total, progress.unit);
    return check_interrupt().ok();
  };
}

}  // namespace relmap::admin
