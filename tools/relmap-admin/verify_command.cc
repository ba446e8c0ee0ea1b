#include <memory>

#include "tools/relmap-admin/findings.h"
#include "tools/relmap-admin/target.h"

namespace relmap::admin {

namespace {

struct VerifyAsked {
  std::string directory;
  std::vector<SessionNumber> sessions;
};

Result<client::VerifySummary> verify_by_daemon(const Context& context, client::Client& daemon,
                                               const VerifyAsked& asked) {
  return daemon.verify(
      asked.sessions,
      [&](const client::Finding& finding) {
        print_finding(context, {finding.reason, finding.frame, finding.message});
      },
      daemon_progress(context));
}

void print(const client::VerifySummary& s, const Context& context) {
  context.bar.end();
  if (context.console.json) return;
  const auto n = [](std::uint64_t value) { return count_text(value); };
  context.console.facts({{"sessions", n(s.sessions)},
                         {"frames", n(s.frames)},
                         {"edges", n(s.edges)},
                         {"landmarks", n(s.landmarks)},
                         {"observations", n(s.observations)},
                         {"features", n(s.features)},
                         {"journal", counted_text(s.journal_records, "record") + " waiting to be applied"},
                         {"findings", s.findings == 0 ? "none: the map is sound" : n(s.findings)}});
}

Answer verify_map(const VerifyAsked& asked, Context& context) {
  const auto target = open_target(context, asked.directory, Access::kRead);
  if (!target.ok()) return {target.status(), target.reason() == Reason::DATA_LOSS, {}};
  const auto summary = target->daemon ? verify_by_daemon(context, *target->daemon, asked)
                                      : verify_engine(context, asked.directory, *target->engine, asked.sessions);
  if (!summary.ok()) return {summary.status(), summary.reason() == Reason::DATA_LOSS, {}};
  if (!asked.sessions.empty() && summary->sessions == 0 && summary->findings == 0)
    return {Status(Reason::NO_SUCH_SESSION, "the map has none of these sessions"), false, {}};
  print(*summary, context);
  Answer answer;
  answer.damage = summary->findings > 0;
  answer.json.add("sessions", summary->sessions)
      .add("frames", summary->frames)
      .add("edges", summary->edges)
      .add("landmarks", summary->landmarks)
      .add("observations", summary->observations)
      .add("features", summary->features)
      .add("journal_records", summary->journal_records)
      .add("findings", summary->findings);
  if (answer.damage)
    answer.status = Status(Reason::DATA_LOSS, std::to_string(summary->findings) +
                                                  " findings; `relmap-admin repair` repairs what can be repaired");
  return answer;
}

}  // namespace

void add_verify(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("verify", "check every checksum, reference and count of a map; changes nothing");
  auto asked = std::make_shared<VerifyAsked>();
  command->add_option("DIR", asked->directory, "data folder")->type_name("FOLDER");
  command->add_option("--session", asked->sessions, "check only frames of these sessions (numbers)");
  command->footer(R"(
Prints each finding as a line, or with --json as a document.

Exit codes:
  0  the map is sound
  3  something was found

Examples:
  relmap-admin verify /var/lib/relmap/map
  relmap-admin --json verify /var/lib/relmap/map | jq -r 'select(.finding).finding.message')");
  command->callback([&action, asked] { action = [asked](Context& context) { return verify_map(*asked, context); }; });
}

}  // namespace relmap::admin
