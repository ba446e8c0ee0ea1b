// The map for drawing: /map/layout, tiles, places, small layouts, and the samples of health.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "tools/console/forward/daemon_link.h"
#include "tools/console/http/router.h"
#include "tools/console/http/server.h"
#include "tools/console/layout/health_samples.h"
#include "tools/console/layout/layout_keeper.h"
#include "tools/console/layout/single_flight.h"
#include "tools/console/login.h"

namespace relmap::console {

// What the console keeps of the map and its daemon. Thread-safe.
class MapRoutes {
 public:
  // `server` and `authorities` as of ConsoleOptions; `cache`: folder for layouts, or empty. `link`, `login` and `http`
  // must outlive it.
  MapRoutes(std::string server, std::string authorities, std::string cache, const DaemonLink& link, Login& login,
            Server& http);

  // The routes use this object.
  void add_to(Router& router);
  // Nothing is kept up any more, and nothing waits for the daemon: calls that run are cancelled.
  void stop();

 private:
  Result<std::unique_ptr<client::Client>> connect(const Caller& caller, std::chrono::milliseconds deadline) const;
  // With the console's own credentials. A token that the daemon refuses is not used again.
  Result<std::unique_ptr<client::Client>> connect_for_all(std::chrono::milliseconds deadline) const;
  Awaitable<Response> tile(const Request& request);
  Awaitable<Response> places(const Request& request);
  Awaitable<Response> around(const Request& request);

  const std::string server_, authorities_;
  const DaemonLink& link_;
  Login& login_;
  Server& http_;
  std::stop_source stop_;  // of calls to the daemon
  SingleFlight<std::string, Response> around_;
  LayoutKeeper keeper_;
  HealthSamples samples_;
};

}  // namespace relmap::console
