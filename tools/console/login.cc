#include "tools/console/login.h"

#include <utility>

#include "proto/access/token.h"
#include "proto/base/json_object.h"
#include "tools/console/http/cookies.h"

namespace relmap::console {

namespace {

constexpr std::chrono::minutes kRemembered{1};
constexpr std::chrono::seconds kAskedAgain{15};
constexpr std::size_t kMaxAddresses = 10'000, kMaxTokens = 1000;
constexpr std::chrono::seconds kJudgedWithin{10};
constexpr char kGetStatus[] = "/relmap.v1.Map/GetStatus";

// Over TLS, and behind a proxy that speaks TLS with browsers, the cookie is for TLS only.
bool is_secure(const Request& request) { return request.tls || request.header("origin").starts_with("https:"); }

Login::Kind kind_of(const DaemonLink& link) {
  if (link.is_socket()) return Login::Kind::kKey;
  return link.uses_tls() ? Login::Kind::kToken : Login::Kind::kNone;
}

}  // namespace

Status LoginTries::begin(const std::string& address, Clock::time_point now) {
  const MutexLock lock(mutex_);
  if (failures_.size() > kMaxAddresses)
    std::erase_if(failures_,
                  [&](const auto& one) { return one.second.empty() || now - one.second.back() > kRemembered; });
  std::deque<Clock::time_point>& own = failures_[address];
  while (!own.empty() && now - own.front() > kRemembered) own.pop_front();
  if (own.size() >= kMaxFailures)
    return {Reason::RATE_LIMITED, "too many logins from this address have failed: wait a minute"};
  own.push_back(now);
  return {};
}

void LoginTries::succeeded(const std::string& address) {
  const MutexLock lock(mutex_);
  const auto own = failures_.find(address);
  if (own == failures_.end()) return;
  if (!own->second.empty()) own->second.pop_back();
  if (own->second.empty()) failures_.erase(own);
}

std::string_view kind_name(Login::Kind kind) {
  switch (kind) {
    case Login::Kind::kToken:
      return "token";
    case Login::Kind::kKey:
      return "key";
    default:
      return "none";
  }
}

Login::Login(DaemonLink& link, std::uint16_t port)
    : link_(link),
      kind_(kind_of(link)),
      key_(kind_ == Kind::kKey ? access::new_token() : std::string()),
      cookie_("relmap_token_" + std::to_string(port)) {}

Result<Caller> Login::last_let_in() const {
  const MutexLock lock(mutex_);
  if (kind_ == Kind::kToken && last_token_.empty())
    return Status(Reason::UNAUTHENTICATED, "the console has no token to ask with: somebody has to log in first");
  return Caller{last_token_};
}

Gate Login::gate() {
  return {[this](const Request& request) { return identify(request); },
          [this](const Caller& caller) { return authorise(caller.token); }, kind_ != Kind::kNone};
}

void Login::add_routes(Router& router) {
  router.add({"POST", "/login", Access::kAnyone, [this](const Request& request) { return log_in(request); }});
  router.add({"POST", "/logout", Access::kAnyone, [this](const Request& request) { return log_out(request); }});
}

Result<Caller> Login::identify(const Request& request) const {
  if (kind_ == Kind::kNone) return Caller{};
  constexpr std::string_view kBearer = "Bearer ";
  std::string shown;
  if (const std::string_view header = request.header("authorization"); header.starts_with(kBearer))
    shown = header.substr(kBearer.size());
  else
    shown = cookie_in(request.header("cookie"), cookie_).value_or("");
  if (shown.empty()) return Status(Reason::UNAUTHENTICATED, "nobody is logged in");
  if (!is_cookie_value(shown)) return Status(Reason::UNAUTHENTICATED, "this is no token");
  if (kind_ == Kind::kToken) return Caller{std::move(shown)};
  if (!equal_in_constant_time(shown, key_))
    return Status(Reason::UNAUTHENTICATED, "this is not the key that the console printed when it started");
  return Caller{};
}

Awaitable<Status> Login::authorise(std::string token) {
  if (kind_ != Kind::kToken) co_return Status();
  const std::string hash = access::sha256(token);
  const auto now = std::chrono::steady_clock::now();
  bool known = false;
  {
    const MutexLock lock(mutex_);
    const auto found = let_in_.find(hash);
    known = found != let_in_.end() && now < found->second;
  }
  if (known) co_return Status();
  Status asked = co_await ask_daemon(token);
  const MutexLock lock(mutex_);
  if (asked.ok()) last_token_ = std::move(token);
  if (let_in_.size() >= kMaxTokens) std::erase_if(let_in_, [&](const auto& one) { return one.second <= now; });
  if (asked.ok() && let_in_.size() < kMaxTokens)
    let_in_[hash] = now + kAskedAgain;
  else
    let_in_.erase(hash);
  co_return asked;
}

Awaitable<Status> Login::ask_daemon(std::string token) {
  CallOptions options;
  options.token = std::move(token);
  options.timeout = kJudgedWithin;
  const auto reply = co_await link_.ask(kGetStatus, "", std::move(options));
  co_return reply.status();
}

Awaitable<Response> Login::log_in(const Request& request) {
  const auto body = JsonObject::parse(request.body);
  const std::string* const given = body ? body->text("token") : nullptr;
  if (!given) co_return error_response({Reason::INVALID_ARGUMENT, "a login is {\"token\": \"...\"}"});
  const std::string token = *given;
  if (Status may = tries_.begin(request.peer, LoginTries::Clock::now()); !may.ok()) co_return error_response(may);
  Status status;
  if (kind_ == Kind::kKey) {
    if (!equal_in_constant_time(token, key_))
      status = {Reason::UNAUTHENTICATED, "this is not the key that the console printed when it started"};
  } else if (kind_ == Kind::kToken) {
    if (!is_cookie_value(token))
      status = {Reason::UNAUTHENTICATED, "this is no token"};
    else
      status = co_await authorise(token);
  }
  // Tries that the daemon did not judge are no failures of the caller.
  if (status.reason() != Reason::UNAUTHENTICATED) tries_.succeeded(request.peer);
  if (!status.ok()) co_return error_response(status);
  Response response;
  response.status = 204;
  if (kind_ != Kind::kNone) response.headers = {{"Set-Cookie", set_cookie(cookie_, token, is_secure(request))}};
  co_return response;
}

Awaitable<Response> Login::log_out(const Request& request) {
  Response response;
  response.status = 204;
  response.headers = {{"Set-Cookie", set_cookie(cookie_, "", is_secure(request))}, {"Clear-Site-Data", "\"cache\""}};
  co_return response;
}

}  // namespace relmap::console
