#include "tools/relmap-admin/cli.h"

#include <ostream>

#include "tools/terminal/command_line.h"
#include "tools/terminal/interrupt.h"

namespace relmap::admin {

namespace {

constexpr char kFooter[] = R"(
DIR is the data folder of a map. If a running relmapd owns it, verify, backup, compact and stats are done by that daemon;
repair, restore, migrate and reindex ask you to stop it first. --server names a daemon instead of a folder, also on another
machine; paths given to it are paths there.

Data goes to stdout, everything else to stderr. With --json: for each finding a document, and one at the end that says
how it went, in the case of failure too (keys reason and message).
Exit codes: 0 fine; 1 failed; 2 wrong usage; 3 damage was found, or something was lost by it; 4 a process works on the
folder and must be stopped first; 5 no daemon answers; 130 interrupted.

Examples:
  relmap-admin stats /var/lib/relmap
  relmap-admin verify /var/lib/relmap
  relmap-admin backup /var/lib/relmap /backup/map-monday
  relmap-admin --server map.example:50070 backup /backup/map-monday
  relmap-admin restore /backup/map-monday /var/lib/relmap
  relmap-admin repair /var/lib/relmap
  relmap-admin reindex /var/lib/relmap --vocabulary campus.vocab
  relmap-admin --json verify /var/lib/relmap | jq -r 'select(.finding).finding.message')";

void declare(CLI::App& app, Context& context, Action& action) {
  app.footer(kFooter);
  app.require_subcommand(1);
  app.fallthrough();
  app.add_option("--server", context.server, "a running daemon instead of a folder: HOST:PORT")->type_name("HOST:PORT");
  app.add_flag("--json", context.console.json, "print answers as JSON, a document a line");
  app.add_flag("-q,--quiet", context.quiet, "say nothing of progress");
  app.add_option("--deadline", context.deadline_s, "seconds that a daemon's work may take")
      ->check(CLI::Range(0.1, 82800.0))
      ->capture_default_str();
  terminal::add_version(app);
  for (const auto add :
       {add_verify, add_repair, add_backup, add_restore, add_compact, add_migrate, add_reindex, add_stats})
    add(app, action);
}

}  // namespace

void Context::show(const std::string& step, std::uint64_t done, std::uint64_t total, const std::string& unit) const {
  if (!quiet) bar.show(step, done, total, unit);
}

void Context::say(const std::string& line) const {
  bar.end();
  if (!console.json) console.out() << line << '\n';
}

ExitCode exit_code(const Answer& answer) {
  if (!answer.status.ok() && terminal::interrupted()) return kInterrupted;
  if (answer.damage) return kDamage;
  switch (answer.status.reason()) {
    case Reason::OK:
      return kFine;
    case Reason::FOLDER_LOCKED:
      return kOwned;
    case Reason::UNREACHABLE:
      return kUnreachable;
    default:
      return kFailed;
  }
}

int run(int argc, const char* const* argv, std::ostream& out, std::ostream& err, bool terminal) {
  CLI::App app("Looks after relmap data folders: verify, repair, back up, restore, compact, migrate, reindex.",
               "relmap-admin");
  terminal::Console console(out, err);
  terminal::ProgressBar bar(err, terminal);
  Context context{console, bar, "", 43200, false};
  Action action;
  declare(app, context, action);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return terminal::end_with(app, e, out, err, kUsage);
  }
  Answer answer;
  try {
    answer = action(context);
  } catch (const CLI::ParseError& e) {
    return terminal::end_with(app, e, out, err, kUsage);
  } catch (const StatusError& error) {
    answer.status = error.status();
  } catch (const std::exception& error) {
    answer.status = Status(Reason::INTERNAL, error.what());
  }
  bar.end();
  answer.json.add("reason", reason_name(answer.status.reason())).add("message", answer.status.message());
  console.reply(answer.json.text());
  out.flush();
  if (!answer.status.ok()) err << answer.status.to_string() << '\n';
  return exit_code(answer);
}

}  // namespace relmap::admin
