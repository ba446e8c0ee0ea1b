// The console: a server for browsers over a link to a daemon.
#pragma once

#include <memory>
#include <string>

#include "proto/base/status.h"
#include "tools/console/forward/daemon_link.h"
#include "tools/console/http/server.h"
#include "tools/console/login.h"
#include "tools/console/map_route.h"

namespace relmap::console {

struct ConsoleOptions {
  std::string server;       // a daemon's data folder, or HOST:PORT
  std::string authorities;  // PEM, of those that may have issued the daemon's certificate; empty: no TLS to the daemon
  std::string version;      // told to browsers
  std::string cache;        // folder of what is kept from one run to the next; empty: there is none
  bool insecure = false;    // serve other machines without TLS
  ServerOptions http;
};

class Console {
 public:
  // Serves when this returns. As Server::listen() and DaemonLink::open(). BAD_CONFIG: other machines would be served
  // without TLS.
  static Result<std::unique_ptr<Console>> start(const ConsoleOptions& options);
  // Ends all calls and connections.
  ~Console();

  const Server& server() const { return *server_; }
  const Login& login() const { return *login_; }

 private:
  Console() = default;
  // In the order in which they use each other. The link ends before the server, on whose threads its calls are told of.
  std::unique_ptr<Server> server_;
  std::unique_ptr<DaemonLink> link_;
  std::unique_ptr<Login> login_;
  std::unique_ptr<MapRoutes> map_;
};

}  // namespace relmap::console
