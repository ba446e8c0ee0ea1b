#include "tools/console/served_daemon.h"

#include <chrono>
#include <csignal>
#include <filesystem>
#include <system_error>
#include <thread>

#include "client/relmap_client.h"
#include "client/server_address.h"

namespace relmap::console {

namespace {

namespace fs = std::filesystem;

constexpr std::chrono::milliseconds kLook{10};

}  // namespace

bool needs_daemon(const std::string& server) {
  std::error_code error;
  if (!fs::exists(server + "/FORMAT", error)) return false;
  client::ClientOptions options;
  options.connect_timeout = std::chrono::milliseconds(2000);
  return client::Client::connect(server, options).reason() == Reason::UNREACHABLE;
}

Result<std::unique_ptr<OwnDaemon>> OwnDaemon::start(const std::string& folder, const std::function<bool()>& going) {
  auto child = terminal::ChildDaemon::start({"--data", folder}, "", SIGTERM);
  if (child.reason() == Reason::NO_SUCH_FILE)
    return Status(Reason::NO_SUCH_FILE,
                  "no daemon serves " + folder + ", and there is no " + child.status().message() + " to start");
  if (!child.ok()) return child.status();
  std::unique_ptr<OwnDaemon> daemon(new OwnDaemon(*std::move(child)));
  for (;; std::this_thread::sleep_for(kLook)) {
    if (const auto end = daemon->ended())
      return Status(Reason::INTERNAL, "relmapd --data " + folder + " ended with " + *end + "; its log above says why");
    if (!going()) return Status(Reason::SHUTTING_DOWN, "stopped while relmapd was starting");
    const auto where = client::resolve_server(folder);
    if (where.ok() && where->pid == daemon->child_.pid()) return daemon;
  }
}

std::optional<std::string> OwnDaemon::ended() {
  const auto end = child_.ended();
  if (!end) return {};
  return end->words();
}

}  // namespace relmap::console
