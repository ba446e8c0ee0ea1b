#include "tools/relmap/cli.h"

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <ostream>

#include "client/server_address.h"
#include "proto/base/json.h"
#include "tools/relmap/commands.h"
#include "tools/terminal/advice.h"
#include "tools/terminal/command_line.h"

namespace relmap::cli {

namespace {

constexpr char kFooter[] = R"(
--server names the daemon: the data folder of a relmapd on this machine, or HOST:PORT. Its default is $RELMAP_SERVER, or
/run/relmap where relmapd runs as a service.
--credentials names the file that proves who asks; its default is $RELMAP_CREDENTIALS, and a folder needs none.
A frame is written session:index, as 3:120; an edge session:index/ordinal, as 3:120/1.
Data goes to stdout, everything else to stderr. With --json a command that fails also prints, as its last document,
{"error": {"reason": "NEW_PLACE", "message": "..."}}; of recordings that fail, ingest says it in its report.

Exit codes:
  0  done
  1  refused or failed; the first word on stderr is the reason
  2  wrong usage
  3  no daemon answers; ingest: keyframes were refused
  5  ingest: everything is in the map, but some of it cannot be trusted

Examples:
  relmap --server /var/lib/relmap/map status
  relmap --server map.example:50070 --credentials anna.pem sessions
  relmap top                             # robots, sessions, worker, memory, once a second
  relmap watch                           # what happens to the map, as it happens
  relmap session freeze survey-2026      # takes no more keyframes, and is not adjusted any more
  relmap session delete test-drive       # takes its frames out of the map, for good
  relmap localise left.png right.png --calibration calib.txt
  relmap match photo.jpg --thumbnails places/
  relmap match 2:17                      # which other places look like this frame?
  relmap localise photo.jpg --near 1:120
  relmap label 1:120 kitchen
  relmap route --from left.png --to kitchen --by time
  relmap --json edges --state candidate | jq .edges[].id
  relmap edges --explain 1:340/1         # why a closure is in force, or not
  relmap edge remove 1:340/1 --dry-run   # what would its removal change?
  relmap edge propose 2:17 5:77          # do these two frames show one place?
  relmap import g2o graph.g2o --loop-scale 2
  relmap ingest --source kitti ~/kitti/sequences/* --jobs 4
  relmap ingest lcmlog-2026-11-21.00     # what robots sent, as lcm-logger recorded it
  relmap export --format tum --out map.tum     # relaxed, a file for each connected part
  relmap map --out map.png --from 1:0 --to kitchen
  relmap edges --suspicion --state accepted --limit 10 --out sheet.png   # which closures should be looked at?
  relmap report --out report.html        # one page: what the map holds, what to look at)";

// Of the package: its service, and where that has its socket while it runs.
constexpr char kServiceUnit[] = "/lib/systemd/system/relmapd.service", kServiceFolder[] = "/run/relmap";

struct GlobalOptions {
  std::string server, credentials;
  double deadline_s = 60;
  bool json = false;
};

// That something is refused is an answer, too.
std::string error_json(const Status& status) {
  return Json()
      .add("error", Json().add("reason", reason_name(status.reason())).add("message", status.message()))
      .text();
}

void declare(CLI::App& app, GlobalOptions& options, Action& action) {
  app.footer(kFooter);
  app.require_subcommand(1);
  app.fallthrough();
  terminal::add_standard_options(app);
  auto* server = app.add_option("--server", options.server,
                                "the daemon: its data folder, that of its socket, or HOST:PORT (default where relmapd "
                                "runs as a service: /run/relmap)")
                     ->type_name("FOLDER|HOST:PORT")
                     ->envname("RELMAP_SERVER");
  if (std::error_code error; std::filesystem::exists(kServiceUnit, error))
    options.server = kServiceFolder;
  else
    server->required();
  app.add_option("--credentials", options.credentials,
                 "file that proves who asks, for a daemon that serves TLS (relmap-admin credentials makes it)")
      ->envname("RELMAP_CREDENTIALS")
      ->type_name("FILE");
  app.add_flag("--json", options.json, "print each reply as canonical proto3 JSON, one document a line");
  app.add_option("--deadline", options.deadline_s, "time limit of each request, in seconds")
      ->check(CLI::Range(0.001, 86400.0))
      ->capture_default_str();
  for (const auto add : {add_status,   add_top,    add_watch,  add_sessions, add_session, add_frame, add_transform,
                         add_localise, add_match,  add_route,  add_label,    add_labels,  add_edges, add_edge,
                         add_import,   add_ingest, add_export, add_map,      add_report,  add_wait})
    add(app, action);
}

}  // namespace

ExitCode exit_code(const Status& status) {
  if (status.ok()) return kOk;
  return status.reason() == Reason::UNREACHABLE ? kUnreachable : kNegativeAnswer;
}

int run(int argc, const char* const* argv, std::ostream& out, std::ostream& err) {
  CLI::App app("Asks a relmap daemon about its map (what is in it, where am I, how do I get there), and edits it.",
               "relmap");
  GlobalOptions options;
  Action action;
  declare(app, options, action);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return terminal::end_with(app, e, out, err, kUsage);
  }

  terminal::Console console(out, err);
  console.json = options.json;
  client::ClientOptions client_options = client::ClientOptions::from_environment();
  client_options.deadline = std::chrono::milliseconds(static_cast<std::int64_t>(options.deadline_s * 1e3));
  client_options.credentials = options.credentials;
  if (options.json) client_options.on_reply = [&](const std::string& document) { console.reply(document); };
  const char* const usual = std::getenv("RELMAP_CREDENTIALS");
  if (const auto where = client::resolve_server(options.server);
      where.ok() && where->is_socket() && !options.credentials.empty() && (!usual || options.credentials != usual))
    err << "the credentials are not used: whoever can open the socket of " << options.server << " is an operator\n";
  std::error_code error;
  const bool stopped = options.server == kServiceFolder && !std::filesystem::is_directory(kServiceFolder, error);
  const auto client = stopped ? Status(Reason::UNREACHABLE, "relmapd does not run (systemctl status relmapd)")
                              : client::Client::connect(options.server, client_options);
  const Status status = client.ok() ? action(**client, console) : client.status();
  if (!status.ok() && !console.outcome_told) console.reply(error_json(status));
  console.report(status);
  if (!console.json && app.got_subcommand("status"))
    if (const std::string advice = terminal::advice_on({status.reason()}); !advice.empty()) err << advice << '\n';
  if (!out.flush()) {
    console.report({Reason::IO_ERROR, "the answer cannot be written (is the disk full?)"});
    if (status.ok()) return kNegativeAnswer;
  }
  if (!client.ok() && status.reason() == Reason::INVALID_ARGUMENT) return kUsage;
  if (status.ok() && console.incomplete) return kIncomplete;
  return status.ok() && console.untrusted ? kUntrusted : exit_code(status);
}

}  // namespace relmap::cli
