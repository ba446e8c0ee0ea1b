// Who asks: what browsers show, and whether the daemon lets them in.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <string>

#include "proto/base/mutex.h"
#include "tools/console/forward/daemon_link.h"
#include "tools/console/http/router.h"
#include "tools/console/http/server.h"

namespace relmap::console {

// Counts failed logins of each address, so that nobody can try many. Thread-safe.
class LoginTries {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMaxFailures = 10;  // of an address within a minute

  // RATE_LIMITED: the address has failed too often. Otherwise the try counts as failed until succeeded() is called.
  Status begin(const std::string& address, Clock::time_point now);
  void succeeded(const std::string& address);

 private:
  Mutex mutex_;
  std::map<std::string, std::deque<Clock::time_point>> failures_ RELMAP_GUARDED_BY(mutex_);
};

class Login {
 public:
  enum class Kind : std::uint8_t {
    kToken,  // the daemon's tokens, which it judges itself
    kKey,    // the console uses the daemon's Unix socket, where it is its operator, and lets in whoever has its key
    kNone,   // the daemon lets everyone in
  };

  // `link` must outlive it. `port`: of the console. Cookies are of a machine, not of a port, and so carry it in their
  // name: two consoles of one machine do not log each other's callers out.
  Login(DaemonLink& link, std::uint16_t port);

  Kind kind() const { return kind_; }
  const std::string& key() const { return key_; }  // 64 hexadecimal digits, new at every start; of kKey

  // By what the console itself asks the daemon, for what it shows to everyone: the token of the caller who was let in
  // last. UNAUTHENTICATED: the daemon asks for tokens, and nobody has logged in yet.
  Result<Caller> last_let_in() const;

  // For Server::serve().
  Gate gate();
  // /login and /logout.
  void add_routes(Router& router);

 private:
  Result<Caller> identify(const Request& request) const;
  Awaitable<Status> authorise(std::string token);
  Awaitable<Status> ask_daemon(std::string token);
  Awaitable<Response> log_in(const Request& request);
  Awaitable<Response> log_out(const Request& request);

  DaemonLink& link_;
  const Kind kind_;
  const std::string key_, cookie_;
  LoginTries tries_;
  mutable Mutex mutex_;
  std::string last_token_ RELMAP_GUARDED_BY(mutex_);
  // By the hash of a token: until when it need not be asked about again.
  std::map<std::string, std::chrono::steady_clock::time_point> let_in_ RELMAP_GUARDED_BY(mutex_);
};

std::string_view kind_name(Login::Kind kind);  // "token", "key", "none"

}  // namespace relmap::console
