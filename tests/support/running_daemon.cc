#include "tests/support/running_daemon.h"

#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <random>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace relmap::testing {

namespace {
using std::chrono::milliseconds;
using std::chrono::steady_clock;

std::string log_file(const DaemonOptions& options) { return options.data + ".log"; }
}  // namespace

std::string random_lcm_url() {
  std::random_device random;
  const auto byte = [&] { return std::to_string(random() % 254 + 1); };
  // A socket gets what is sent to its port, whatever the group, so a port is sought that nobody has.
  unsigned port = 0;
  for (int attempt = 0; attempt < 100; ++attempt) {
    port = 20000 + random() % 12000;
    const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in any{};
    any.sin_family = AF_INET;
    any.sin_port = htons(static_cast<std::uint16_t>(port));
    const bool free = bind(socket, reinterpret_cast<const sockaddr*>(&any), sizeof any) == 0;
    close(socket);
    if (free) break;
  }
  return "udpm://239." + byte() + "." + byte() + "." + byte() + ":" + std::to_string(port) + "?ttl=0";
}

std::vector<std::string> daemon_arguments(const DaemonOptions& options) {
  std::vector<std::string> arguments{options.program.empty() ? built_program("relmapd") : options.program,
                                     "--data",
                                     options.data,
                                     "--listen",
                                     "127.0.0.1:0",
                                     "--memory-budget-mb",
                                     std::to_string(options.memory_budget_mb)};
  if (options.credentials.empty())
    arguments.emplace_back("--insecure");
  else
    arguments.insert(arguments.end(), {"--credentials", options.credentials});
  if (!options.lcm.empty()) arguments.insert(arguments.end(), {"--lcm", options.lcm});
  if (!options.lcm.empty() && options.credentials.empty())
    arguments.insert(arguments.end(), {"--lcm-authentication", "none"});
  arguments.insert(arguments.end(), options.more.begin(), options.more.end());
  return arguments;
}

RunningDaemon::RunningDaemon(const DaemonOptions& options, milliseconds patience) : options_(options) {
  process_ = std::make_unique<Process>(daemon_arguments(options), ProcessOptions{.standard_output = "",
                                                                                 .standard_error = log_file(options),
                                                                                 .own_network = options.own_network,
                                                                                 .environment = options.environment});
  const auto deadline = steady_clock::now() + patience;
  while (patience.count() > 0 && !serving()) {
    if (!process_->running()) throw std::runtime_error("relmapd ended: " + log());
    if (steady_clock::now() > deadline) throw std::runtime_error("relmapd does not serve: " + log());
    std::this_thread::sleep_for(milliseconds(5));
  }
}

std::string RunningDaemon::endpoint(const std::string& key) const {
  std::istringstream lines(read_text(options_.data + "/endpoint"));
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with(key + " ")) return line.substr(key.size() + 1);
  return "";
}

bool RunningDaemon::serving() const { return endpoint("pid") == std::to_string(process_->pid()); }

std::string RunningDaemon::address() const { return endpoint("address"); }

std::string RunningDaemon::http() const { return endpoint("http"); }

std::unique_ptr<client::Client> RunningDaemon::client() const {
  return client::Client::connect(options_.data).or_throw();
}

std::string RunningDaemon::log() const { return read_text(log_file(options_)); }

int RunningDaemon::stop() {
  process_->signal(SIGTERM);
  return process_->wait(kPatience).value_or(-1);
}

}  // namespace relmap::testing
