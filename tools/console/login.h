// Who asks: what browsers show, and whether the daemon lets them in.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/base/mutex.h"
#include "tools/console/browser_sessions.h"
#include "tools/console/http/router.h"
#include "tools/console/http/server.h"
#include "tools/console/login_tries.h"

namespace relmap::console {

// Thread-safe.
class Login {
 public:
  enum class Kind : std::uint8_t {
    kToken,  // the daemon's tokens, which it judges itself
    kKey,    // the console uses the daemon's Unix socket, where it is its operator, and lets in whoever has its key
    kNone,   // the daemon lets everyone in
  };
  using Clock = std::chrono::steady_clock;
  // Asks the daemon with this token, and returns the role of its owner ("operator"), or why there is none; DEADLINE: no
  // answer came within the patience.
  using AskRole = std::function<Awaitable<Result<std::string>>(std::string token, std::chrono::milliseconds patience)>;

  // For how long a caller need not be asked about again, and for how long one whom the daemon has let in goes on to see
  // what the console has in its memory while the daemon is away.
  static constexpr std::chrono::seconds kAskedAgain{15};
  static constexpr std::chrono::minutes kGrace{15};

  // `ask` is called with kToken only. `port`: of the console. Cookies are of a machine, not of a port, and so carry it
  // in their name: two consoles of one machine do not log each other's callers out.
  Login(Kind kind, AskRole ask, std::uint16_t port, std::function<Clock::time_point()> now = Clock::now);

  Kind kind() const { return kind_; }
  const std::string& key() const { return key_; }  // 64 hexadecimal digits, new at every start; of kKey

  // By what the console itself asks the daemon, for what it shows to everyone: the token of the session that has begun
  // last, of those that still exist; if there is none, of who has shown one without a session and was let in last, for
  // kGrace. UNAUTHENTICATED: the daemon asks for tokens, and nobody has logged in.
  Result<Caller> last_let_in() const;
  // The daemon has refused this token: UNAUTHENTICATED for any call, NOT_ALLOWED for its status. All sessions with it
  // end, and nothing is shown to its owner any more.
  void refused(const std::string& token);
  // Whether it may be told what the daemon tells operators only.
  bool is_operator(const Caller& caller) const;

  // For Server::serve().
  Gate gate();
  // For handlers that make calls as the caller: a token that the daemon has not let in yet is asked about before, so
  // that wrong ones count as failed logins. OK: the daemon judges the call itself.
  Awaitable<Status> admit(const Caller& caller);
  // /login and /logout.
  void add_routes(Router& router);

 private:
  struct LetIn {
    Clock::time_point last;       // when the daemon has said so
    Clock::time_point ask_again;  // until then nobody asks
    std::string role;
  };
  // The daemon is being asked about a token. Others who want to know it wait with a timer of their own.
  struct Question {
    std::vector<std::weak_ptr<boost::asio::steady_timer>> waiting;  // on the strands of those who wait
    Status answer;
  };

  Result<Caller> identify(const Request& request);
  Result<Caller> by_bearer(std::string_view shown, const std::string& address);
  Status check_key(const std::string& shown, const std::string& address);
  Awaitable<Status> authorise(const Caller& caller);
  Awaitable<Status> judge(std::string token, std::string address);
  Awaitable<Status> ask_once(std::string token, std::string hash, std::chrono::milliseconds patience);
  Status take(const std::string& token, const std::string& hash, const Result<std::string>& role);
  Awaitable<Response> log_in(const Request& request);
  Awaitable<Response> log_out(const Request& request);
  void end_sessions_of(const Request& request);

  const Kind kind_;
  const AskRole ask_;
  const std::string key_, cookie_;
  const std::function<Clock::time_point()> now_;
  LoginTries tries_;
  BrowserSessions sessions_;
  mutable Mutex mutex_;
  // By the hash of a token: those that the daemon has let in, and has not refused since.
  std::map<std::string, LetIn> let_in_ RELMAP_GUARDED_BY(mutex_);
  std::map<std::string, std::shared_ptr<Question>> asking_ RELMAP_GUARDED_BY(mutex_);
  std::string last_bearer_ RELMAP_GUARDED_BY(mutex_);
};

std::string_view kind_name(Login::Kind kind);  // "token", "key", "none"

}  // namespace relmap::console
