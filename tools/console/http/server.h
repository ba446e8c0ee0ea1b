// Serves browsers over HTTP/1.1, with or without TLS (Boost.Beast).
#pragma once

#include <boost/asio/awaitable.hpp>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "proto/base/status.h"
#include "tools/console/http/message.h"
#include "tools/console/http/origin.h"
#include "tools/console/http/router.h"

namespace relmap::console {

struct ServerOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;         // 0: any free one
  std::string certificate, key;   // files in PEM, which may be one; read again within ten seconds after they change
  std::vector<HostName> proxied;  // --host

  // Limits.
  std::size_t max_connections = 256;                // for one more the oldest that waits for a request is closed
  std::size_t max_bodies = std::size_t{128} << 20;  // bytes of all bodies together
  std::chrono::milliseconds header_patience{10'000};
  std::chrono::milliseconds idle_patience{60'000};
  std::chrono::milliseconds body_patience{60'000};
  std::chrono::milliseconds write_patience{300'000};  // in which each write must get out
};

// Who may have what is not for everyone. Both are called from several threads at a time.
struct Gate {
  // The caller that the request names; UNAUTHENTICATED: none, or one that cannot be.
  std::function<Result<Caller>(const Request&)> identify;
  // Whether the daemon lets this caller in.
  std::function<Awaitable<Status>(const Caller&)> authorise;
};

class Server {
 public:
  static constexpr std::uint32_t kMaxHeader = 16 * 1024;

  // Listens. PORT_IN_USE; BAD_CONFIG: the files of TLS cannot be used, or this machine has no such address.
  static Result<std::unique_ptr<Server>> listen(const ServerOptions& options);
  ~Server();

  std::uint16_t port() const;
  // Whether only this machine can reach it.
  bool is_local() const;
  bool uses_tls() const;

  // Serves from now on; once.
  void serve(Router router, Gate gate);
  // Serves nothing any more; returns when no handler runs. Handlers that wait are not resumed.
  void stop();

  // Runs `work` on a thread for what takes long, and resumes the handler with its answer. An exception of `work` is
  // thrown by it.
  Awaitable<Response> on_worker(std::function<Response()> work);

 private:
  struct Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// Waits in a handler until `done` returns true, looking every 50 ms, or until the time has come. Returns what `done`
// returned last.
Awaitable<bool> wait_until(std::function<bool()> done, std::chrono::steady_clock::time_point until);

}  // namespace relmap::console
