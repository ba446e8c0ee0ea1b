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

  // Limits. A connection is proven once a caller was let in by it; strangers get less (see Gate).
  std::size_t max_connections = 256;                // for one more another is closed, see Server
  std::size_t max_bodies = std::size_t{128} << 20;  // bytes of all bodies that have come and are held, together
  std::chrono::milliseconds header_patience{10'000};
  std::chrono::milliseconds idle_patience{60'000};
  std::chrono::milliseconds body_patience{60'000}, unproven_body_patience{10'000};  // for the whole body
  std::chrono::milliseconds write_patience{300'000},
      unproven_write_patience{30'000};  // in which each write must get out
};

// Who may have what is not for everyone. Both functions are called from several threads at a time.
struct Gate {
  // The caller that the request names; UNAUTHENTICATED: none, or one that cannot be. Must not wait.
  std::function<Result<Caller>(const Request&)> identify;
  // Whether the daemon lets this caller in. It is asked for each request of Access::kAuthorised, and for each of
  // Access::kCaller whose body is larger than kMaxUnjudgedBody, so it should remember its answers for some seconds.
  std::function<Awaitable<Status>(const Caller&)> authorise;
  // Whether being let in tells callers from strangers. False where everyone is let in: no connection is proven then.
  bool proves = true;
};

// What a handler waits for on threads of the server, by what it does there.
enum class Work : std::uint8_t {
  kComputes,    // for as long as it takes; by as many threads as the machine can use
  kAsksDaemon,  // waits for the daemon, for some seconds at most
};

// Where there is no room for one more connection, the oldest of those that are not proven is closed, whatever it does,
// of the address that has most of them; if all are proven, the oldest that waits for a request. (Of IPv6, 64 bits count
// as the address.)
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
  // Serves nothing any more; returns when no handler and no work runs. Handlers that wait are not resumed.
  void stop();

  // Runs `what` on a thread for such work, and resumes the handler of `request` when it has ended. An exception of it
  // is thrown here. If the browser goes before it has begun, it is left out, and DEADLINE is thrown.
  Awaitable<void> work(Work kind, const Request& request, std::function<void()> what);

 private:
  struct Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// Waits in a handler until `done` returns true, looking every 50 ms, or until the time has come. Returns what `done`
// returned last.
Awaitable<bool> wait_until(std::function<bool()> done, std::chrono::steady_clock::time_point until);

}  // namespace relmap::console
