#include "tools/relmap-admin/findings.h"

#include "storage/maintenance/verify.h"
#include "storage/rocksdb/recorded_hash.h"
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

Result<client::VerifySummary> verify_engine(const Context& context, const std::string& directory,
                                            const storage::Engine& engine, const std::vector<SessionNumber>& sessions) {
  storage::VerifyOptions options;
  options.sessions = sessions;
  const auto on_finding = [&](const storage::Finding& finding) { print_finding(context, finding); };
  const storage::OnProgress on_progress = maintenance_progress(context);
  const auto map = storage::verify(*engine.snapshot(), options, on_finding, on_progress);
  if (!map.ok()) return map.status();
  if (!map->complete) return check_interrupt();
  const auto journal = storage::verify_journal(engine, on_finding, on_progress);
  if (!journal.ok()) return journal.status();
  if (!journal->complete) return check_interrupt();
  std::uint64_t findings = map->findings + journal->findings;
  if (findings == 0 && sessions.empty()) {
    const auto agrees = storage::agrees_with_recorded_hash(directory, *engine.snapshot(),
                                                           engine_progress(context, "comparing with its hash"));
    if (agrees.reason() == Reason::DATA_LOSS) {
      print_finding(context, {Reason::DATA_LOSS, {}, agrees.status().message(), false});
      ++findings;
    } else if (!agrees.ok()) {
      return agrees.status();
    }
  }
  return client::VerifySummary{map->sessions,
                               map->frames,
                               map->edges,
                               map->landmarks,
                               map->observations,
                               map->features,
                               journal->journal_records,
                               findings};
}

}  // namespace relmap::admin
