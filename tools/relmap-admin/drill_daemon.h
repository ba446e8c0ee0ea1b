// A relmapd that a drill starts on a restored map, and stops.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "client/relmap_client.h"
#include "tools/terminal/child_daemon.h"

namespace relmap::admin {

// It is killed with this object, unless it was stopped.
class DrillDaemon {
 public:
  // Starts the relmapd beside this program on the data folder `map`, at its socket only and without LCM, and returns
  // when it serves. `log`: a file that it writes to. `vocabulary`: empty for the one shipped. `going` is called several
  // times a second; if it returns a status other than OK, that is the result. A daemon that ends instead: its own
  // reason, from the last line of its log. NO_SUCH_FILE: there is no relmapd; UNSUPPORTED: it is of another release.
  static Result<std::unique_ptr<DrillDaemon>> start(const std::string& map, const std::string& log,
                                                    const std::string& vocabulary,
                                                    const std::function<Status()>& going);
  client::Client& client() { return *client_; }
  // Ends it in order, and returns how it ended.
  Status stop();

 private:
  DrillDaemon(terminal::ChildDaemon child, std::string log) : child_(std::move(child)), log_(std::move(log)) {}
  Status wait_until_it_serves(const std::string& map, const std::function<Status()>& going);
  // Its end, with the exit code in its words; nullopt while it runs.
  std::optional<Status> ended();

  terminal::ChildDaemon child_;
  const std::string log_;
  std::unique_ptr<client::Client> client_;
};

}  // namespace relmap::admin
