#include "tools/relmap-admin/findings.h"

#include "tools/relmap-admin/target.h"

namespace relmap::admin {

void print_finding(const Context& context, const storage::Finding& finding) {
  const std::string reason(reason_name(finding.reason));
  const std::string frame = finding.frame.session == 0 ? "" : finding.frame.to_string();
  context.say(reason + "  " + (frame.empty() ? "" : "frame " + frame + ": ") + finding.what +
              (finding.repaired ? "  (repaired)" : ""));
  Json json;
  json.add("reason", reason).add("frame", frame).add("message", finding.what).add("repaired", finding.repaired);
  context.console.reply(Json().add("finding", json).text());
}

storage::OnProgress maintenance_progress(const Context& context) {
  return [&context](const storage::MaintenanceProgress& progress) {
    context.show(progress.step, progress.done, progress.total, progress.unit);
    return check_interrupt().ok();
  };
}

}  // namespace relmap::admin
