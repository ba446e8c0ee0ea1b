#include "tools/relmap-admin/cli.h"

#include <ostream>

#include "tools/terminal/advice.h"
#include "tools/terminal/command_line.h"
#include "tools/terminal/interrupt.h"

namespace relmap::admin {

namespace {

constexpr char kFooter[] = R"(
DIR is the data folder of a map. If a running relmapd owns it, that daemon does verify, backup, compact and stats;
repair, restore, migrate and reindex need it to be stopped first. drill and migrate --check rehearse, and change nothing. --server names a daemon instead of a folder, which may
be on another machine; paths are then paths on that machine.

Data goes to stdout, everything else to stderr. With --json each finding is a document, and the last document gives the
outcome in the keys reason and message, also after a failure.

Exit codes:
  0    fine
  1    failed; the first word on stderr is the reason
  2    wrong usage
  3    damage was found, or data were lost to it
  4    another process owns the folder and must be stopped first
  5    no daemon answers
  130  interrupted

Examples:
  relmap-admin stats /var/lib/relmap/map
  relmap-admin verify /var/lib/relmap/map
  relmap-admin backup /var/lib/relmap/map /backup/map-monday
  relmap-admin --server map.example:50070 --credentials anna.pem backup /backup/map-monday
  relmap-admin backup /var/lib/relmap/map /backup --keep 7
  relmap-admin drill /backup
  relmap-admin restore /backup/map-monday /var/lib/relmap/map
  relmap-admin migrate /var/lib/relmap/map --check
  relmap-admin repair /var/lib/relmap/map
  relmap-admin reindex /var/lib/relmap/map --vocabulary campus.vocab
  relmap-admin credentials ca /etc/relmap/credentials --host map.example
  relmap-admin credentials new /etc/relmap/credentials cart-1 --role robot --out cart-1.pem
  relmap-admin explain DISK_FULL         # what it means, and what to do; alerts, too
  relmap-admin --json verify /var/lib/relmap/map | jq -r 'select(.finding).finding.message')";

void declare(CLI::App& app, Context& context, Action& action) {
  app.footer(kFooter);
  app.require_subcommand(1);
  app.fallthrough();
  app.add_option("--server", context.server, "address of a running daemon, instead of a folder")
      ->type_name("HOST:PORT");
  app.add_option("--credentials", context.credentials, "file that proves who asks, for a daemon that serves TLS")
      ->envname("RELMAP_CREDENTIALS")
      ->type_name("FILE");
  app.add_flag("--json", context.console.json, "print answers as JSON, one document a line");
  app.add_flag("-q,--quiet", context.quiet, "show no progress");
  app.add_option("--deadline", context.deadline_s, "time limit of work that a daemon does, in seconds")
      ->check(CLI::Range(0.1, 82800.0))
      ->capture_default_str();
  terminal::add_standard_options(app);
  for (const auto add : {add_verify, add_repair, add_backup, add_drill, add_restore, add_compact, add_migrate,
                         add_reindex, add_stats, add_log_level, add_credentials, add_explain})
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
  CLI::App app(
      "Looks after relmap data folders (verify, repair, back up, drill, restore, compact, migrate, reindex), makes the "
      "credentials of a fleet, and explains reasons and alerts.",
      "relmap-admin");
  terminal::Console console(out, err);
  terminal::ProgressBar bar(err, terminal);
  Context context{console, bar, "", "", 43200, false};
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
  console.report(answer.status);
  if (const std::string advice = terminal::advice_on({answer.status.reason()}); !advice.empty() && !console.json)
    err << advice << '\n';
  return exit_code(answer);
}

}  // namespace relmap::admin
