// relmapd: the map server.
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include "server/monitor/last_words.h"
#include "server/monitor/log.h"
#include "server/ops/config.h"
#include "server/ops/daemon.h"
#include "server/ops/process.h"
#include "server/ops/settings.h"
#include "server/ops/signals.h"
#include "server/rpc/log_level.h"
#include "server/service/service_manager.h"
#include "tools/terminal/command_line.h"

namespace {

using relmap::Reason;
using relmap::Status;
using relmap::ops::Config;
using Who = relmap::ingest::LcmAuthentication::Who;

constexpr const char* kFooter = R"(Examples:
  relmapd --data /srv/map
  relmapd --data /srv/map --lcm 'udpm://239.255.76.67:7667?ttl=0' --credentials /etc/relmap/credentials
  relmapd --config /etc/relmap/relmapd.yaml --check-config
  relmap-admin credentials ca /etc/relmap/credentials --host map.lab
  relmapd --data /srv/map --listen 0.0.0.0:50070 --credentials /etc/relmap/credentials
  relmapd --data /srv/map --http 50071                     # curl 127.0.0.1:50071/readyz, /livez, /metrics
  relmapd --data map --listen 127.0.0.1:50070 --insecure   # anyone who can reach the port may edit the map

gRPC is served at the Unix socket DIR/socket, which only the user that runs the daemon can open: relmap --server DIR
uses it. --listen serves over TCP, too, and docs/security.md tells who may do what there.

All settings can be given in the configuration file; some have no option: ingest.* (which robots may send, and how
much), tls.*, access, lcm.*, socket, rpc.*, routes.mixes, rba.* and others. --sample-config prints a file with all of
them, explained, and --print-config what would be in force.

SIGHUP reads the configuration file and the access list again, and puts in force what can change while the daemon runs
(log_level, ingest.*, hung_after_s); of the rest the log says NEEDS_RESTART. Certificates are read within ten seconds
after they change. Under systemd (Type=notify) the daemon tells when it serves, and feeds the watchdog as long as its
journal and its worker make progress.
SIGTERM or SIGINT stops the daemon after everything acknowledged is applied and committed. A second signal ends it at
once, without loss: the next start applies the rest.

Exit codes:
  0  stopped by a signal; with --check-config: the configuration is sound
  1  the last commit failed, memory ran out (BUDGET_EXCEEDED), or an internal error; nothing acknowledged is lost
  2  BAD_CONFIG, or wrong usage
  3  FOLDER_LOCKED: another process owns the data folder
  4  PORT_IN_USE: another process listens at the address of --listen
  5  the data folder cannot be used: NOT_A_MAP (it is neither empty nor a map's), IO_ERROR, DISK_FULL, READ_ONLY,
     DATA_LOSS, UNKNOWN_FORMAT_VERSION
  6  the vocabulary cannot be used: NO_SUCH_FILE, CORRUPT, WRONG_VOCABULARY)";

int exit_code(Reason reason) {
  switch (reason) {
    case Reason::OK:
      return 0;
    case Reason::BAD_CONFIG:
      return 2;
    case Reason::FOLDER_LOCKED:
      return 3;
    case Reason::PORT_IN_USE:
      return 4;
    case Reason::IO_ERROR:
    case Reason::DISK_FULL:
    case Reason::READ_ONLY:
    case Reason::DATA_LOSS:
    case Reason::UNKNOWN_FORMAT_VERSION:
    case Reason::NOT_A_MAP:
      return 5;
    case Reason::NO_SUCH_FILE:
    case Reason::CORRUPT:
    case Reason::WRONG_VOCABULARY:
      return 6;
    default:
      return 1;
  }
}

// The options of the command line. What they leave out keeps the value of the configuration file, or the default.
struct CommandLine {
  std::string config_file;
  std::optional<std::string> data, listen, http, credentials, lcm, lcm_authentication, vocabulary, log_level,
      log_format;
  std::vector<std::string> backup_roots;
  std::optional<std::uint64_t> memory_budget_mb;
  bool deterministic = false, insecure = false, no_closures = false, check_config = false;
  bool print_config = false, sample_config = false;

  void declare(CLI::App& app) {
    app.add_option("--data", data, "Data folder of the map, which holds nothing else; created if it does not exist")
        ->type_name("DIR");
    app.add_option("--config", config_file, "YAML file of settings; options of the command line override it")
        ->type_name("FILE");
    app.add_option("--listen", listen,
                   "Address at which gRPC is served over TCP, too; port 0 takes any free port, which is written to "
                   "DIR/endpoint; none: only at DIR/socket (default)")
        ->type_name("HOST:PORT");
    app.add_option(
           "--http", http,
           "Serves metrics for Prometheus (/metrics) and health (/livez, /readyz) over HTTP; a PORT alone is of "
           "this machine, where nobody needs credentials; none: off (default)")
        ->type_name("[HOST:]PORT");
    app.add_option("--credentials", credentials,
                   "Folder made by relmap-admin credentials: the certificate to serve TLS with, who may call, and the "
                   "secret of the keys by which robots are known over LCM")
        ->type_name("FOLDER");
    app.add_option("--lcm", lcm,
                   "Takes keyframes over LCM: from a multicast group (udpm://GROUP:PORT?ttl=N) or from a log "
                   "(file://PATH); none "
                   "turns LCM off (default)")
        ->type_name("URL");
    app.add_option("--lcm-authentication", lcm_authentication,
                   "Whose messages over LCM must prove who sent them, by the keys of --credentials: all (default) or "
                   "none; the configuration file can list robots")
        ->check(CLI::IsMember({"all", "none"}));
    app.add_option("--backup-root", backup_roots,
                   "Folder below which operators may have backups made by this daemon; none by default")
        ->type_name("FOLDER")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_option("--memory-budget-mb", memory_budget_mb,
                   "Memory budget for everything that grows with map and load, in MB (default 1024, at least 32)");
    app.add_option("--vocabulary", vocabulary, "Visual vocabulary (default: the one shipped)")->type_name("FILE");
    app.add_option("--log-level", log_level, "What the log tells (default info)")
        ->check(CLI::IsMember(relmap::rpc::log_levels()));
    app.add_option(
           "--log-format", log_format,
           "Form of the log's lines: text, json, journal (with systemd's priorities), or auto, which is journal "
           "where standard error leads to it and else text (default)")
        ->check(CLI::IsMember(relmap::monitor::log_formats()));
    app.add_flag(
        "--deterministic", deterministic,
        "Look up places and relax at fixed points of the input, so that the same input gives the same map; slower");
    app.add_flag("--no-closures", no_closures,
                 "Do not recognise places, so that no loop is closed (to measure what closures improve)");
    app.add_flag("--insecure", insecure,
                 "Serve --listen without TLS: everyone who can reach the port may edit the map");
    app.add_flag("--check-config", check_config,
                 "Check whether the daemon could start with these settings, write nothing, and exit");
    app.add_flag("--print-config", print_config, "Print all settings as they would be in force, and exit");
    app.add_flag("--sample-config", sample_config, "Print a configuration file with all settings explained, and exit");
    relmap::terminal::add_standard_options(app);
  }

  Status apply(Config& config) const {
    if (!config_file.empty())
      if (Status status = relmap::ops::read_config(config_file, config); !status.ok())
        return {Reason::BAD_CONFIG, status.message()};
    if (data) config.data = *data;
    if (listen) config.listen = relmap::ops::unless_none(*listen);
    if (http) config.http = relmap::ops::unless_none(*http);
    if (credentials) config.credentials = *credentials;
    if (lcm) config.lcm = relmap::ops::unless_none(*lcm);
    if (lcm_authentication) config.lcm_authentication = *lcm_authentication == "all" ? Who::kAll : Who::kNobody;
    for (const std::string& root : backup_roots)
      config.backup_roots.push_back(std::filesystem::absolute(root).lexically_normal().string());
    if (vocabulary) config.vocabulary = *vocabulary;
    if (log_level) config.log_level = *log_level;
    if (log_format) config.log_format = *log_format;
    if (memory_budget_mb) {
      const std::string text = "memory_budget_mb: " + std::to_string(*memory_budget_mb);
      if (Status status = relmap::ops::parse_config(text, "--memory-budget-mb", config); !status.ok()) return status;
    }
    config.map.deterministic |= deterministic;
    config.insecure |= insecure;
    if (no_closures) config.map.closures = false;
    relmap::ops::complete_config(config);
    return relmap::ops::check_config(config);
  }
};

constexpr std::size_t kOwnFiles = 1024;  // the map's, the journal's and others that are not connections
constexpr std::size_t kFewConnections = 16;

int fail(const Status& status) {
  spdlog::error("{}", status.to_string());
  return exit_code(status.reason());
}

// So few that connections cannot take the files that the map needs. They are counted over TCP and again at the socket.
void limit_connections(Config& config, bool tell = true) {
  const std::size_t files = relmap::ops::raise_file_limit();
  const std::size_t most = std::max(kFewConnections, (files - std::min(files, kOwnFiles)) / 2);
  if (config.connections.total <= most) return;
  config.connections.lowered = {Reason::TOO_MANY_FILES, std::to_string(files) + " files may be open, too few for " +
                                                            std::to_string(config.connections.total) +
                                                            " connections; " + std::to_string(most) +
                                                            " are taken. Raise the hard limit (LimitNOFILE=)"};
  if (tell) spdlog::warn("{}", config.connections.lowered.to_string());
  config.connections.total = most;
  config.connections.per_peer = std::min(config.connections.per_peer, most);
}

// At SIGHUP: what can change while the daemon runs is read again. Nothing of it can end the daemon.
void reload(const CommandLine& line, relmap::ops::Daemon& daemon) try {
  Config fresh;
  if (const Status status = line.apply(fresh); !status.ok()) {
    spdlog::error("SIGHUP: the settings stay as they were: {}", status.to_string());
  } else {
    limit_connections(fresh, /*tell=*/false);
    if (daemon.reload(fresh))
      spdlog::info("SIGHUP: settings and access list were read again, and the files of TLS are within ten seconds");
  }
} catch (const std::exception& error) {
  spdlog::error("SIGHUP: not everything was read again: {}", error.what());
}

int run(const CommandLine& line, Config config) {
  relmap::service::ServiceManager manager;
  limit_connections(config);
  auto daemon = relmap::ops::Daemon::start(config);
  if (daemon.reason() == Reason::SHUTTING_DOWN) {
    spdlog::info("stopped: {}", daemon.status().message());
    return 0;
  }
  if (!daemon.ok()) return fail(daemon.status());
  const auto state = [&] {
    return relmap::service::ServiceManager::State{(*daemon)->health().live, (*daemon)->status_line()};
  };
  struct Stops {  // before the daemon is gone, of which the manager's thread asks
    relmap::service::ServiceManager& told;
    ~Stops() { told.stops(); }
  } const stops{manager};
  manager.serves(state);
  std::optional<int> signal;
  while (!(signal = relmap::ops::wait_for_signal(std::chrono::seconds(1))) || *signal == SIGHUP) {
    if (signal) {
      manager.reloads();
      reload(line, **daemon);
      manager.serves(state);
    }
    (*daemon)->tick();
  }
  manager.stops();
  spdlog::info("signal {}: stopping", *signal);
  const Status stopped = (*daemon)->stop();
  if (!stopped.ok()) return fail(stopped);
  spdlog::info("stopped");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  relmap::ops::block_stop_signals();  // first, so that a SIGHUP while the daemon starts does not end it
  relmap::monitor::name_reason_of_sudden_end();
  umask(S_IRWXG | S_IRWXO);  // what the daemon writes is nobody else's
  // Silences gRPC's own log (of a port in use, for example): relmapd reports such errors itself.
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  relmap::monitor::set_up_log("auto");
  CLI::App app("A map server for fleets of stereo robots.", "relmapd");
  app.footer(kFooter);
  CommandLine line;
  line.declare(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return relmap::terminal::end_with(app, error, std::cout, std::cerr, 2);
  }
  if (line.sample_config) {
    std::cout << relmap::ops::sample_config();
    return 0;
  }
  Config config;
  if (Status status = line.apply(config); !status.ok()) return fail(status);
  relmap::monitor::set_up_log(config.log_format);
  relmap::rpc::set_log_level(config.log_level);
  if (line.print_config) {
    std::cout << relmap::ops::print_config(config);
    return 0;
  }
  if (line.check_config) {
    if (Status sound = relmap::ops::Daemon::check(config); !sound.ok()) return fail(sound);
    std::cout << "the configuration is sound\n";
    return 0;
  }
  try {
    return run(line, config);
  } catch (const std::exception&) {
    return fail(relmap::caught_status());
  }
}
