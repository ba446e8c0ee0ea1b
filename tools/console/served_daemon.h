// The daemon that the console uses: one that runs already, or one of its own.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "proto/base/status.h"
#include "tools/terminal/child_daemon.h"

namespace relmap::console {

// A relmapd that this process has started on a data folder. It ends in order with this object or process, however that
// ends. Its log goes to standard error.
class OwnDaemon {
 public:
  // Starts the relmapd beside this program, and returns when it serves. Must be called by a thread that lives as long
  // as the process. `going`: is asked several times a second; false: the daemon is ended, and SHUTTING_DOWN returned.
  // NO_SUCH_FILE: there is no relmapd. INTERNAL: it has ended instead; its log says why.
  static Result<std::unique_ptr<OwnDaemon>> start(const std::string& folder, const std::function<bool()>& going);
  // How it ended by itself, once: "exit code 1"; nullopt while it runs.
  std::optional<std::string> ended();

 private:
  explicit OwnDaemon(terminal::ChildDaemon child) : child_(std::move(child)) {}
  terminal::ChildDaemon child_;
};

// Whether a daemon must be started to serve this: it is the folder of a map that none serves.
bool needs_daemon(const std::string& server);

}  // namespace relmap::console
