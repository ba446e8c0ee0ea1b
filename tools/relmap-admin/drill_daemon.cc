#include "tools/relmap-admin/drill_daemon.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>
#include <vector>

#include "client/server_address.h"
#include "proto/base/version.h"

namespace relmap::admin {

namespace {

constexpr std::chrono::milliseconds kLook{50};

std::string last_line(const std::string& file) {
  std::ifstream in(file);
  std::string last;
  for (std::string line; std::getline(in, line);)
    if (!line.empty()) last = line;
  return last;
}

// The reason that a line of the daemon's log names: its first word that is one.
Reason reason_in(const std::string& line) {
  for (std::size_t at = 0; at < line.size();) {
    const std::size_t begin = line.find_first_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ", at);
    if (begin == std::string::npos) break;
    const std::size_t end = std::min(line.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ_", begin), line.size());
    for (std::uint16_t number = 1; number < 1000; ++number)
      if (is_reason(number) && reason_name(static_cast<Reason>(number)) == line.substr(begin, end - begin))
        return static_cast<Reason>(number);
    at = end;
  }
  return Reason::INTERNAL;
}

}  // namespace

Result<std::unique_ptr<DrillDaemon>> DrillDaemon::start(const std::string& map, const std::string& log,
                                                        const std::string& vocabulary,
                                                        const std::function<Status()>& going) {
  std::vector<std::string> arguments{"--data", map, "--listen", "none", "--lcm", "none"};
  if (!vocabulary.empty()) arguments.insert(arguments.end(), {"--vocabulary", vocabulary});
  auto child = terminal::ChildDaemon::start(arguments, log, SIGKILL);
  if (child.reason() == Reason::NO_SUCH_FILE)
    return Status(Reason::NO_SUCH_FILE,
                  "there is no " + child.status().message() + ": the drill starts the relmapd beside this program");
  if (!child.ok()) return child.status();
  std::unique_ptr<DrillDaemon> daemon(new DrillDaemon(*std::move(child), log));
  if (Status serves = daemon->wait_until_it_serves(map, going); !serves.ok()) return serves;
  const auto status = daemon->client().status();
  if (!status.ok()) return status.status();
  if (status->version != version())
    return Status(Reason::UNSUPPORTED, "the relmapd beside this program is of release " + status->version +
                                           ", this program of " + std::string(version()));
  return daemon;
}

Status DrillDaemon::wait_until_it_serves(const std::string& map, const std::function<Status()>& going) {
  for (;; std::this_thread::sleep_for(kLook)) {
    if (const auto end = ended()) return end->ok() ? Status(Reason::INTERNAL, "relmapd ended before it served") : *end;
    if (Status go = going(); !go.ok()) return go;
    const auto where = client::resolve_server(map);
    if (!where.ok() || where->pid != child_.pid()) continue;
    auto client = client::Client::connect(map);
    if (!client.ok()) return client.status();
    client_ = std::move(*client);
    return {};
  }
}

std::optional<Status> DrillDaemon::ended() {
  const auto end = child_.ended();
  if (!end) return {};
  if (end->ok()) return Status();
  const std::string line = last_line(log_);
  return Status(reason_in(line), "relmapd ended with " + end->words() + ": " + line);
}

Status DrillDaemon::stop() {
  client_.reset();
  child_.ask_to_end();
  for (;;) {
    if (const auto end = ended()) return *end;
    std::this_thread::sleep_for(kLook);
  }
}

}  // namespace relmap::admin
