// The daemon that the console forwards calls to, whatever their methods.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/server_address.h"
#include "proto/base/status.h"
#include "tools/console/forward/grpc_web.h"

namespace relmap::console {

// What a call is made with.
struct CallOptions {
  std::string token = {};                                          // "authorization: Bearer TOKEN"; empty: none
  std::vector<std::pair<std::string, std::string>> metadata = {};  // visible ASCII
  std::optional<std::chrono::microseconds> timeout = {};
};

// A call that runs, unary or server-streaming. To be used in one coroutine, on one strand. Its end cancels the call.
class ForwardedCall {
 public:
  struct Shared;
  class Reactor;
  ForwardedCall(std::shared_ptr<Shared> shared, std::shared_ptr<Reactor> reactor);
  ForwardedCall(ForwardedCall&&) noexcept = default;
  ~ForwardedCall();

  // The next message; nullopt at the end of the call. No message is asked for before, so that whoever asks slowly is a
  // slow caller to the daemon. `gone`, if it is not empty, is asked once a second: if it returns true, the call is
  // cancelled, and its end returned.
  boost::asio::awaitable<std::optional<std::string>> next(std::function<bool()> gone = {});
  // How it ended, once next() has returned nullopt.
  const CallEnd& end() const;
  // The same as a status of ours.
  Status status() const;

 private:
  std::shared_ptr<Shared> shared_;
  std::shared_ptr<Reactor> reactor_;
};

// Thread-safe.
class DaemonLink {
 public:
  // `server`: the data folder of a daemon on this machine, or HOST:PORT. `authorities`: PEM, of those that may have
  // issued its certificate; empty: no TLS. Nothing is asked of the daemon here. INVALID_ARGUMENT, CORRUPT, NOT_ALLOWED,
  // UNREACHABLE: as client::resolve_server().
  static Result<std::unique_ptr<DaemonLink>> open(const std::string& server, const std::string& authorities);
  // Cancels all calls and waits until gRPC has let go of them. The executors of their coroutines must still exist.
  ~DaemonLink();

  // Whether it is reached by its Unix socket, where it takes every caller for its operator. It stays so.
  bool is_socket() const;
  bool uses_tls() const;
  // Where it answers now. As client::resolve_server(). NEEDS_RESTART: by its socket, and it was not when the link was
  // opened, or the other way round: who may do what there is decided otherwise.
  Result<client::ServerAddress> where() const;

  // `told` is called, by any thread, with the token of each call that the daemon ends as UNAUTHENTICATED. To be set
  // before the first call.
  void on_refusal(std::function<void(const std::string& token)> told);

  // Begins a call of "/relmap.v1.Map/GetStatus", for example, for the coroutine that calls this. `message`: the request
  // as it is on the wire. NEEDS_RESTART: as where().
  boost::asio::awaitable<Result<ForwardedCall>> call(std::string method, std::string message, CallOptions options);
  // The reply of a unary call. Fails with the daemon's reason; UNREACHABLE if none answers.
  boost::asio::awaitable<Result<std::string>> ask(std::string method, std::string message, CallOptions options);

 private:
  struct Impl;
  explicit DaemonLink(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::console
