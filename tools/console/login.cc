#include "tools/console/login.h"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <utility>

#include "proto/access/token.h"
#include "proto/base/json_object.h"
#include "tools/console/http/cookies.h"

namespace relmap::console {

namespace asio = boost::asio;

namespace {

constexpr std::size_t kMaxTokens = 1000;
// Who is known to the console does not wait long for a daemon that hangs: he may see what is in its memory.
constexpr std::chrono::milliseconds kJudgedWithin{10'000}, kJudgedAgainWithin{2000};
constexpr char kOperator[] = "operator";

// Over TLS, and behind a proxy that speaks TLS with browsers, the cookie is for TLS only.
bool is_secure(const Request& request) { return request.tls || request.header("origin").starts_with("https:"); }

bool is_refusal(Reason reason) { return reason == Reason::UNAUTHENTICATED || reason == Reason::NOT_ALLOWED; }

// Whether nobody has judged the caller, since the daemon does not answer.
bool is_away(Reason reason) {
  return reason == Reason::UNREACHABLE || reason == Reason::DEADLINE || reason == Reason::SHUTTING_DOWN;
}

}  // namespace

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

Login::Login(Kind kind, AskRole ask, std::uint16_t port, std::function<Clock::time_point()> now)
    : kind_(kind),
      ask_(std::move(ask)),
      key_(kind_ == Kind::kKey ? access::new_token() : std::string()),
      cookie_("relmap_token_" + std::to_string(port)),
      now_(std::move(now)) {}

Result<Caller> Login::last_let_in() const {
  if (kind_ != Kind::kToken) return Caller{};
  const Clock::time_point now = now_();
  if (auto token = sessions_.newest(now)) return Caller{std::move(*token)};
  const MutexLock lock(mutex_);
  const auto found = last_bearer_.empty() ? let_in_.end() : let_in_.find(access::sha256(last_bearer_));
  if (found == let_in_.end() || now - found->second.last > kGrace)
    return Status(Reason::UNAUTHENTICATED, "the console has no token to ask with: somebody has to log in first");
  return Caller{last_bearer_};
}

void Login::refused(const std::string& token) {
  if (token.empty()) return;
  sessions_.end_all_of(token);
  const std::string hash = access::sha256(token);
  const MutexLock lock(mutex_);
  let_in_.erase(hash);
  if (last_bearer_ == token) last_bearer_.clear();
}

bool Login::is_operator(const Caller& caller) const {
  if (kind_ != Kind::kToken) return true;
  const MutexLock lock(mutex_);
  const auto found = let_in_.find(access::sha256(caller.token));
  return found != let_in_.end() && found->second.role == kOperator;
}

Gate Login::gate() {
  return {[this](const Request& request) { return identify(request); },
          [this](const Caller& caller) { return authorise(caller); }, kind_ != Kind::kNone};
}

void Login::add_routes(Router& router) {
  router.add({"POST", "/login", Access::kAnyone, [this](const Request& request) { return log_in(request); }});
  router.add({"POST", "/logout", Access::kAnyone, [this](const Request& request) { return log_out(request); }});
}

Result<Caller> Login::identify(const Request& request) {
  if (kind_ == Kind::kNone) return Caller{};
  constexpr std::string_view kBearer = "Bearer ";
  if (const std::string_view header = request.header("authorization"); header.starts_with(kBearer))
    return by_bearer(header.substr(kBearer.size()), request.peer);
  // Of several the one that means something: the others may be planted, or of an earlier console.
  const std::vector<std::string_view> shown = cookies_in(request.header("cookie"), cookie_);
  for (const std::string_view id : shown)
    if (auto token = sessions_.use(id, now_())) return Caller{std::move(*token)};
  return Status(Reason::UNAUTHENTICATED,
                shown.empty() ? "nobody is logged in"
                              : "this session has ended: its token is not valid any more, the console was started "
                                "again, or nothing was asked for long");
}

Result<Caller> Login::by_bearer(std::string_view shown, const std::string& address) {
  if (!is_cookie_value(shown)) return Status(Reason::UNAUTHENTICATED, "this is no token");
  std::string token(shown);
  if (kind_ == Kind::kToken) return Caller{std::move(token), address};
  if (Status right = check_key(token, address); !right.ok()) return right;
  return Caller{};
}

Status Login::check_key(const std::string& shown, const std::string& address) {
  const std::string hash = access::sha256(shown);
  if (Status may = tries_.begin(address, hash, now_()); !may.ok()) return may;
  if (!equal_in_constant_time(shown, key_))
    return {Reason::UNAUTHENTICATED, "this is not the key that the console printed when it started"};
  tries_.succeeded(address, hash);
  return {};
}

Awaitable<Status> Login::authorise(const Caller& caller) {
  if (kind_ != Kind::kToken) co_return Status();
  const bool bearer = !caller.from.empty();
  std::string token = caller.token, address = caller.from;
  Status judged = co_await judge(token, std::move(address));
  if (judged.ok() && bearer) {
    const MutexLock lock(mutex_);
    last_bearer_ = std::move(token);
  }
  co_return judged;
}

Awaitable<Status> Login::admit(const Caller& caller) {
  if (kind_ != Kind::kToken || caller.from.empty()) co_return Status();
  bool known = false;
  {
    const MutexLock lock(mutex_);
    known = let_in_.contains(access::sha256(caller.token));
  }
  if (known) co_return Status();
  Status judged = co_await authorise(caller);
  const bool refused = judged.reason() == Reason::UNAUTHENTICATED || judged.reason() == Reason::RATE_LIMITED;
  co_return refused ? judged : Status();
}

// `address`: empty if a wrong token is no failed try of anybody.
Awaitable<Status> Login::judge(std::string token, std::string address) {
  const std::string hash = access::sha256(token);
  bool known = false, asked_lately = false;
  {
    const MutexLock lock(mutex_);
    const auto found = let_in_.find(hash);
    known = found != let_in_.end();
    asked_lately = known && now_() < found->second.ask_again;
  }
  if (asked_lately) co_return Status();
  const bool tries = !known && !address.empty();
  if (tries)
    if (Status may = tries_.begin(address, hash, now_()); !may.ok()) co_return may;
  Status judged = co_await ask_once(std::move(token), hash, known ? kJudgedAgainWithin : kJudgedWithin);
  // Tries that the daemon did not judge are no failures of the caller.
  if (tries && judged.reason() != Reason::UNAUTHENTICATED) tries_.succeeded(address, hash);
  co_return judged;
}

// However many want to know it at a time, the daemon is asked once.
Awaitable<Status> Login::ask_once(std::string token, std::string hash, std::chrono::milliseconds patience) {
  const auto timer = std::make_shared<asio::steady_timer>(co_await asio::this_coro::executor);
  timer->expires_at(Clock::time_point::max());
  std::shared_ptr<Question> question;
  bool first = false;
  {
    const MutexLock lock(mutex_);
    std::shared_ptr<Question>& asked = asking_[hash];
    first = !asked;
    if (first) asked = std::make_shared<Question>();
    if (!first) asked->waiting.push_back(timer);
    question = asked;
  }
  if (!first) {
    boost::system::error_code ignored;
    co_await timer->async_wait(asio::redirect_error(asio::use_awaitable, ignored));
    const MutexLock lock(mutex_);
    co_return question->answer;
  }
  Status answer;
  try {
    const Result<std::string> role = co_await ask_(token, patience);
    answer = take(token, hash, role);
  } catch (...) {
    answer = caught_status();
  }
  std::vector<std::weak_ptr<asio::steady_timer>> waiting;
  {
    const MutexLock lock(mutex_);
    question->answer = answer;
    waiting.swap(question->waiting);
    asking_.erase(hash);
  }
  // On the strand of each, and so after it has begun to wait.
  for (const auto& one : waiting)
    if (const auto other = one.lock()) asio::post(other->get_executor(), [other] { other->cancel(); });
  co_return answer;
}

// What the daemon's answer means.
Status Login::take(const std::string& token, const std::string& hash, const Result<std::string>& role) {
  if (is_refusal(role.reason())) refused(token);
  const Clock::time_point now = now_();
  const MutexLock lock(mutex_);
  if (role.ok()) {
    if (let_in_.size() >= kMaxTokens && !let_in_.contains(hash))
      let_in_.erase(std::min_element(let_in_.begin(), let_in_.end(),
                                     [](const auto& a, const auto& b) { return a.second.last < b.second.last; }));
    let_in_[hash] = {now, now + kAskedAgain, *role};
    return {};
  }
  if (const auto found = let_in_.find(hash); is_away(role.reason()) && found != let_in_.end()) {
    if (now - found->second.last > kGrace) return role.status();
    found->second.ask_again = std::min(now + kAskedAgain, found->second.last + kGrace);
    return {};
  }
  return role.status();
}

Awaitable<Response> Login::log_in(const Request& request) {
  const auto body = JsonObject::parse(request.body);
  const std::string* const given = body ? body->text("token") : nullptr;
  if (!given) co_return error_response({Reason::INVALID_ARGUMENT, "a login is {\"token\": \"...\"}"});
  const std::string shown = *given;
  Response response;
  response.status = 204;
  if (kind_ == Kind::kNone) co_return response;
  Status status;
  if (!is_cookie_value(shown))
    status = {Reason::UNAUTHENTICATED, "this is no token"};
  else if (kind_ == Kind::kKey)
    status = check_key(shown, request.peer);
  else
    status = co_await judge(shown, request.peer);
  if (!status.ok()) co_return error_response(status);
  end_sessions_of(request);
  const std::string id = sessions_.begin(kind_ == Kind::kToken ? shown : std::string(), now_());
  response.headers.emplace_back("Set-Cookie", set_cookie(cookie_, id, is_secure(request)));
  co_return response;
}

Awaitable<Response> Login::log_out(const Request& request) {
  end_sessions_of(request);
  Response response;
  response.status = 204;
  response.headers.emplace_back("Set-Cookie", set_cookie(cookie_, "", is_secure(request)));
  response.headers.emplace_back("Clear-Site-Data", "\"cache\"");
  co_return response;
}

void Login::end_sessions_of(const Request& request) {
  for (const std::string_view id : cookies_in(request.header("cookie"), cookie_)) sessions_.end(id);
}

}  // namespace relmap::console
