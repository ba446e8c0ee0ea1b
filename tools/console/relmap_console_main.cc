// relmap-console: serves the operator's console to browsers.
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <boost/asio/ip/address.hpp>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "client/relmap_client.h"
#include "proto/access/credentials.h"
#include "proto/base/read_number.h"
#include "proto/base/version.h"
#include "server/service/service_manager.h"
#include "tools/console/console.h"
#include "tools/console/open_browser.h"
#include "tools/console/served_daemon.h"
#include "tools/terminal/command_line.h"
#include "tools/terminal/interrupt.h"

namespace {

using namespace relmap;
namespace fs = std::filesystem;

constexpr const char* kFooter =
    R"(SERVER is the data folder of a relmapd on this machine, or HOST:PORT. If no daemon serves the folder, the relmapd beside
this program is started on it, and ends with the console. The default is $RELMAP_SERVER.

The address to open is printed to standard output. How a browser logs in follows from how the console reaches the daemon:
  its Unix socket     with the key in the printed address, which is new at every start
  TLS                 with a token of the daemon (relmap-admin credentials new FOLDER NAME --token), and as its owner
  TCP without TLS     not at all: that daemon lets everyone in
A login ends when the browser logs out, after 12 hours in which it asked for nothing, and with the console.

Other machines reach the console only over TLS (--tls-certificate), or through a proxy that serves TLS (--host).

Examples:
  relmap-console ~/map --open
  relmap-console /run/relmap --listen 127.0.0.1:8086 --host console.lab     # behind a proxy
  relmap-console map.lab:50070 --credentials ca.crt --listen 0.0.0.0:8443 --tls-certificate server.pem

Exit codes:
  0  stopped by a signal
  1  failed; the first word on stderr is the reason
  2  wrong usage, or files or an address that cannot be used (BAD_CONFIG, NO_SUCH_FILE)
  3  no daemon serves the folder, and none could be started
  4  PORT_IN_USE: another process listens at the address of --listen)";

constexpr std::uint16_t kUsualPort = 8086, kPortsToTry = 32;
constexpr std::chrono::milliseconds kLook{50};
constexpr std::chrono::seconds kBrowserReadsWithin{60};  // the page of --open; it may have to start first

int exit_code(const Status& status) {
  switch (status.reason()) {
    case Reason::BAD_CONFIG:
    case Reason::NO_SUCH_FILE:
    case Reason::INVALID_ARGUMENT:
      return 2;
    case Reason::UNREACHABLE:
      return 3;
    case Reason::PORT_IN_USE:
      return 4;
    default:
      return 1;
  }
}

int fail(const Status& status) {
  std::cerr << status.to_string() << '\n';
  return exit_code(status);
}

void tell(const std::string& line) { std::cerr << line << '\n'; }

struct CommandLine {
  std::string server, credentials, cache;
  std::optional<std::string> listen;
  std::vector<std::string> hosts;
  std::string certificate, key;
  bool open = false, insecure = false;

  void declare(CLI::App& app) {
    app.add_option("server", server, "The daemon: its data folder, or HOST:PORT")
        ->type_name("SERVER")
        ->envname("RELMAP_SERVER")
        ->required();
    app.add_option(
           "--listen", listen,
           "Address at which browsers are served (default 127.0.0.1:8086, or the next port that is free); port 0 "
           "takes any free one")
        ->type_name("HOST:PORT");
    app.add_option(
           "--host", hosts,
           "Another name by which browsers know the console, such as that of a proxy before it; with its port if "
           "that is not the usual one. Requests for other names are refused")
        ->type_name("NAME[:PORT]")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_option("--tls-certificate", certificate,
                   "Serves browsers over TLS with this certificate, in PEM; read again within ten seconds after it "
                   "changes")
        ->type_name("FILE");
    app.add_option("--tls-key", key, "The key of this certificate (default: in the same file)")->type_name("FILE");
    app.add_option(
           "--credentials", credentials,
           "Who may have issued the certificate of the daemon: ca.crt of relmap-admin credentials, for a daemon "
           "that serves TLS at HOST:PORT")
        ->type_name("FILE")
        ->envname("RELMAP_CONSOLE_CREDENTIALS");
    app.add_option("--cache", cache,
                   "Folder where layouts of maps are kept, so that a map is drawn at once the next time (default: "
                   "$CACHE_DIRECTORY, or relmap-console in $XDG_CACHE_HOME or ~/.cache)")
        ->type_name("FOLDER");
    app.add_flag("--open", open, "Open the console in a browser of this desktop (xdg-open)");
    app.add_flag("--insecure", insecure,
                 "Serve other machines without TLS: who hears the network reads keys and tokens");
    terminal::add_standard_options(app);
  }
};

Status parse_listen(const std::string& text, console::ServerOptions& options) {
  const std::size_t colon = text.rfind(':');
  const Status bad{Reason::INVALID_ARGUMENT, "--listen " + text + " is no HOST:PORT"};
  if (colon == std::string::npos || colon == 0) return bad;
  if (!read_number(std::string_view(text).substr(colon + 1), options.port)) return bad;
  options.host = text.substr(0, colon);
  if (options.host.size() > 2 && options.host.front() == '[' && options.host.back() == ']')
    options.host = options.host.substr(1, options.host.size() - 2);
  return {};
}

std::string cache_folder(const CommandLine& line) {
  const auto variable = [](const char* name) {
    const char* const value = std::getenv(name);
    return value ? std::string(value) : std::string();
  };
  if (!line.cache.empty()) return line.cache;
  if (const std::string own = variable("CACHE_DIRECTORY"); !own.empty()) return own;  // of systemd
  const std::string xdg = variable("XDG_CACHE_HOME"), home = variable("HOME");
  if (!xdg.empty()) return xdg + "/relmap-console";
  return home.empty() ? "" : home + "/.cache/relmap-console";
}

// For this user only. Whoever keeps something there tells what is wrong with it.
std::string made_folder(const std::string& path) {
  std::error_code ignored;
  if (!path.empty()) fs::create_directories(path, ignored);
  return path;
}

Result<console::ConsoleOptions> options_of(const CommandLine& line) {
  console::ConsoleOptions options;
  options.server = line.server;
  options.version = version();
  options.cache = made_folder(cache_folder(line));
  options.insecure = line.insecure;
  options.http.port = kUsualPort;
  if (line.listen)
    if (Status sound = parse_listen(*line.listen, options.http); !sound.ok()) return sound;
  for (const std::string& name : line.hosts) {
    auto host = console::parse_host(name);
    if (!host.ok()) return Status(Reason::INVALID_ARGUMENT, "--host " + host.status().message());
    options.http.proxied.push_back(std::move(*host));
  }
  if (line.certificate.empty() && !line.key.empty())
    return Status(Reason::INVALID_ARGUMENT, "--tls-key needs --tls-certificate");
  options.http.certificate = line.certificate;
  options.http.key = line.key.empty() ? line.certificate : line.key;
  if (!line.credentials.empty()) {
    auto authorities = access::read_authorities(line.credentials);
    if (!authorities.ok()) return authorities.status();
    options.authorities = std::move(*authorities);
  }
  return options;
}

// Without --listen another port does as well, if the usual one is taken.
Result<std::unique_ptr<console::Console>> start(console::ConsoleOptions& options, bool any_port) {
  for (std::uint16_t tried = 1;; ++tried) {
    auto console = console::Console::start(options);
    if (console.ok() || console.reason() != Reason::PORT_IN_USE || !any_port || tried == kPortsToTry) return console;
    ++options.http.port;
  }
}

// The address to open. A console that listens at all addresses has none of its own: it is known by the first --host, or
// by the machine's name.
std::string address_of(const console::Console& console, const console::ConsoleOptions& options) {
  const console::Server& server = console.server();
  std::string host = options.http.host, port = std::to_string(server.port());
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address(host, error);
  if (!error && address.is_unspecified()) {
    char machine[256] = {};
    host = gethostname(machine, sizeof machine - 1) == 0 && console::parse_host(machine).ok() ? machine : "localhost";
    if (!options.http.proxied.empty()) {
      host = options.http.proxied.front().name;
      if (const std::string& own = options.http.proxied.front().port; !own.empty()) port = own;
    }
  }
  if (host.find(':') != std::string::npos) host = "[" + host + "]";
  const std::string key = console.login().kind() == console::Login::Kind::kKey ? "#key=" + console.login().key() : "";
  return (server.uses_tls() ? "https://" : "http://") + host + ":" + port + "/" + key;
}

int run(const CommandLine& line) {
  service::ServiceManager manager;
  auto options = options_of(line);
  if (!options.ok()) return fail(options.status());
  terminal::watch_interrupts();
  std::signal(SIGPIPE, SIG_IGN);
  std::unique_ptr<console::OwnDaemon> own;
  if (console::needs_daemon(line.server)) {
    tell("no daemon serves " + line.server + ": starting one");
    auto started = console::OwnDaemon::start(line.server, [] { return !terminal::interrupted(); });
    if (started.reason() == Reason::SHUTTING_DOWN) return 0;
    if (!started.ok()) {
      std::cerr << started.status().to_string() << '\n';
      return 3;
    }
    own = std::move(*started);
  }
  auto console = start(*options, !line.listen);
  if (!console.ok()) return fail(console.status());
  const console::Server& server = (*console)->server();
  if (!line.listen && server.port() != kUsualPort)
    tell("port " + std::to_string(kUsualPort) + " is taken: using " + std::to_string(server.port()));
  const std::string address = address_of(**console, *options);
  std::cout << address << std::endl;
  std::unique_ptr<console::OpenedBrowser> browser;
  if (line.open) {
    auto opened = console::OpenedBrowser::open(address);
    if (opened.ok())
      browser = std::move(*opened);
    else
      tell(opened.status().to_string());
  }
  const auto opened_until = std::chrono::steady_clock::now() + kBrowserReadsWithin;
  manager.serves([&] {
    return service::ServiceManager::State{true, "serving browsers at port " + std::to_string(server.port())};
  });
  int code = 0;
  while (!terminal::interrupted()) {
    if (own)
      if (const auto end = own->ended()) {
        code = fail({Reason::UNREACHABLE, "the daemon that the console had started ended with " + *end});
        break;
      }
    if (browser && std::chrono::steady_clock::now() > opened_until) browser.reset();
    std::this_thread::sleep_for(kLook);
  }
  manager.stops();
  console->reset();
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  umask(S_IRWXG | S_IRWXO);
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);  // what it says of handshakes that fail, callers are told
  CLI::App app("Serves a console for operators of a relmap daemon to browsers: the map, its closures, its fleet.",
               "relmap-console");
  app.footer(kFooter);
  CommandLine line;
  line.declare(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return terminal::end_with(app, error, std::cout, std::cerr, 2);
  }
  try {
    return run(line);
  } catch (const std::exception&) {
    return fail(caught_status());
  }
}
