// Who is let in, and for how long, with a daemon that answers as each test wants, at a time that each test sets.
#include "tools/console/login.h"

#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/strand.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/use_future.hpp>
#include <future>
#include <map>
#include <string>
#include <thread>
#include <vector>

namespace relmap::console {
namespace {

namespace asio = boost::asio;
using std::chrono::seconds;

class LoginTest : public ::testing::Test {
 protected:
  ~LoginTest() override {
    work_.reset();
    for (std::thread& thread : threads_) thread.join();
  }

  Login make(Login::Kind kind) {
    return {kind, [this](std::string token, std::chrono::milliseconds) { return ask(std::move(token)); }, 8086,
            [this] { return Login::Clock::time_point(seconds(now_)); }};
  }

  template <typename T>
  T run(Awaitable<T> coroutine) {
    return asio::co_spawn(asio::make_strand(io_), std::move(coroutine), asio::use_future).get();
  }
  Status authorise(Login& login, const Caller& caller) { return run(started(login, caller)); }
  Awaitable<Status> started(Login& login, Caller caller) {
    ++started_;
    const Gate gate = login.gate();
    co_return co_await gate.authorise(caller);
  }
  // As the server asks: by what the request shows.
  Status ask_for(Login& login, const Request& request) {
    const auto caller = login.gate().identify(request);
    return caller.ok() ? authorise(login, *caller) : caller.status();
  }
  static Request with(const std::string& name, const std::string& value, const std::string& peer = "10.0.0.1") {
    Request request;
    request.headers[name] = value;
    request.peer = peer;
    return request;
  }
  static Request bearer(const std::string& token, const std::string& peer = "10.0.0.1") {
    return with("authorization", "Bearer " + token, peer);
  }
  static Request cookie(const std::string& id) { return with("cookie", "relmap_token_8086=" + id); }

  Response post(Login& login, const std::string& path, Request request) {
    Router router;
    login.add_routes(router);
    const auto match = router.find("POST", path).or_throw();
    return run(match.route->handler(request));
  }
  Response try_login(Login& login, const std::string& token, const std::string& peer = "10.0.0.1") {
    Request request;
    request.body = R"({"token": ")" + token + R"("})";
    request.peer = peer;
    return post(login, "/login", request);
  }
  // The id of the session.
  std::string log_in(Login& login, const std::string& token) {
    const Response answer = try_login(login, token);
    EXPECT_EQ(answer.status, 204u) << answer.body;
    if (answer.headers.empty()) return "";
    const std::string& set = answer.headers.at(0).second;
    EXPECT_TRUE(set.starts_with("relmap_token_8086=")) << set;
    EXPECT_NE(set.find("; HttpOnly; SameSite=Strict"), std::string::npos) << set;
    const std::size_t begin = set.find('=') + 1;
    return set.substr(begin, set.find(';') - begin);
  }

  // The daemon.
  Awaitable<Result<std::string>> ask(std::string token) {
    ++asked_;
    asio::steady_timer timer(co_await asio::this_coro::executor);
    while (held_) {
      timer.expires_after(std::chrono::milliseconds(1));
      co_await timer.async_wait(asio::use_awaitable);
    }
    if (away_) co_return Status(Reason::UNREACHABLE, "nothing answers");
    const auto role = roles_.find(token);
    if (role == roles_.end()) co_return Status(Reason::UNAUTHENTICATED, "it is not known");
    if (role->second == "none") co_return Status(Reason::NOT_ALLOWED, "it may nothing");
    co_return role->second;
  }

  std::map<std::string, std::string> roles_{{"anna", "operator"}, {"bert", "reader"}};
  std::atomic<std::int64_t> now_{1'000'000};  // seconds
  std::atomic<bool> held_{false}, away_{false};
  std::atomic<int> asked_{0}, started_{0};

  asio::io_context io_;
  asio::executor_work_guard<asio::io_context::executor_type> work_ = asio::make_work_guard(io_);
  std::vector<std::thread> threads_ = [this] {
    std::vector<std::thread> threads;
    for (int i = 0; i < 3; ++i) threads.emplace_back([this] { io_.run(); });
    return threads;
  }();
};

TEST_F(LoginTest, TheCookieIsNotTheToken) {
  Login login = make(Login::Kind::kToken);
  const std::string id = log_in(login, "anna");
  EXPECT_NE(id, "anna");
  EXPECT_EQ(login.gate().identify(cookie(id))->token, "anna");
  EXPECT_EQ(login.gate().identify(cookie("anna")).reason(), Reason::UNAUTHENTICATED);
  EXPECT_EQ(login.gate().identify(bearer(id))->token, id) << "which the daemon does not know";
  EXPECT_EQ(ask_for(login, bearer(id)).reason(), Reason::UNAUTHENTICATED);
  EXPECT_TRUE(ask_for(login, bearer("anna")).ok()) << "scripts show the token";
  Login after_a_restart = make(Login::Kind::kToken);
  EXPECT_EQ(after_a_restart.gate().identify(cookie(id)).reason(), Reason::UNAUTHENTICATED);

  Login by_key = make(Login::Kind::kKey);
  const std::string own = log_in(by_key, by_key.key());
  EXPECT_NE(own, by_key.key());
  EXPECT_TRUE(ask_for(by_key, cookie(own)).ok());
  EXPECT_TRUE(ask_for(by_key, bearer(by_key.key())).ok());
  EXPECT_EQ(by_key.gate().identify(cookie(own))->token, "") << "the daemon asks for none at its socket";
  EXPECT_EQ(ask_for(by_key, cookie(by_key.key())).reason(), Reason::UNAUTHENTICATED);
  EXPECT_EQ(asked_, 2) << "the daemon is asked nothing where it has a socket";
}

TEST_F(LoginTest, ASessionEndsWhenItsCallerLogsOutOrIsAway) {
  Login login = make(Login::Kind::kToken);
  const std::string id = log_in(login, "anna"), other = log_in(login, "anna");
  const Response out = post(login, "/logout", cookie(id));
  EXPECT_EQ(out.status, 204u);
  EXPECT_NE(out.headers.at(0).second.find("Max-Age=0"), std::string::npos);
  EXPECT_EQ(ask_for(login, cookie(id)).reason(), Reason::UNAUTHENTICATED);
  EXPECT_TRUE(ask_for(login, cookie(other)).ok()) << "of another browser";
  now_ += 12 * 3600 + 1;
  EXPECT_EQ(ask_for(login, cookie(other)).reason(), Reason::UNAUTHENTICATED);
}

TEST_F(LoginTest, OfSeveralCookiesTheOneThatIsASessionCounts) {
  Login login = make(Login::Kind::kToken);
  const std::string id = log_in(login, "anna");
  EXPECT_TRUE(ask_for(login, cookie("planted; relmap_token_8086=" + id)).ok());
  EXPECT_TRUE(ask_for(login, cookie(id + "; relmap_token_8086=planted")).ok());
  // Logging in with it ends the session that it was before.
  Request again = cookie("planted; relmap_token_8086=" + id);
  again.body = R"({"token": "anna"})";
  EXPECT_EQ(post(login, "/login", again).status, 204u);
  EXPECT_EQ(ask_for(login, cookie(id)).reason(), Reason::UNAUTHENTICATED);
}

TEST_F(LoginTest, ManyWhoWaitAreOneQuestionToTheDaemon) {
  constexpr int kTiles = 50;
  Login login = make(Login::Kind::kToken);
  for (const bool wrong : {false, true}) {
    asked_ = started_ = 0;
    held_ = true;
    std::vector<std::future<Status>> answers;
    for (int i = 0; i < kTiles; ++i)
      answers.push_back(asio::co_spawn(asio::make_strand(io_),
                                       started(login, Caller{wrong ? "wrong" : "anna", "10.0.0.1"}), asio::use_future));
    while (started_ < kTiles) std::this_thread::yield();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    held_ = false;
    for (auto& answer : answers) EXPECT_EQ(answer.get().reason(), wrong ? Reason::UNAUTHENTICATED : Reason::OK);
    // The last three may only have begun when the answer was there, and after a refusal everyone is asked about anew.
    EXPECT_LE(asked_, wrong ? 4 : 1);
  }
  now_ += 14;
  asked_ = 0;
  EXPECT_TRUE(authorise(login, {"anna"}).ok());
  EXPECT_EQ(asked_, 0);
  now_ += 2;
  EXPECT_TRUE(authorise(login, {"anna"}).ok());
  EXPECT_EQ(asked_, 1);
}

TEST_F(LoginTest, WrongTokensOfAnyRequestAreFailedLogins) {
  Login login = make(Login::Kind::kToken);
  EXPECT_TRUE(ask_for(login, bearer("anna")).ok());
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(try_login(login, "wrong" + std::to_string(i)).status, 401u);
    EXPECT_EQ(ask_for(login, bearer("bad" + std::to_string(i))).reason(), Reason::UNAUTHENTICATED);
  }
  asked_ = 0;
  EXPECT_EQ(try_login(login, "wrong").status, 429u);
  EXPECT_EQ(ask_for(login, bearer("bad")).reason(), Reason::RATE_LIMITED);
  // Before a call to the daemon, too.
  EXPECT_EQ(run(login.admit({"bad", "10.0.0.1"})).reason(), Reason::RATE_LIMITED);
  EXPECT_EQ(asked_, 0);
  EXPECT_EQ(ask_for(login, bearer("bad", "10.0.0.2")).reason(), Reason::UNAUTHENTICATED) << "another address";
  now_ += 20;
  EXPECT_TRUE(ask_for(login, bearer("anna")).ok()) << "who was let in before";
  now_ += 61;
  EXPECT_EQ(ask_for(login, bearer("bad")).reason(), Reason::UNAUTHENTICATED);
  EXPECT_EQ(try_login(login, "bert").status, 204u);

  Login by_key = make(Login::Kind::kKey);
  for (int i = 0; i < 10; ++i)
    EXPECT_EQ(by_key.gate().identify(bearer("bad" + std::to_string(i))).reason(), Reason::UNAUTHENTICATED);
  EXPECT_EQ(by_key.gate().identify(bearer("bad")).reason(), Reason::RATE_LIMITED);
  EXPECT_EQ(try_login(by_key, "bad").status, 429u);
}

TEST_F(LoginTest, ATokenIsAskedAboutBeforeItsFirstCallOnly) {
  Login login = make(Login::Kind::kToken);
  EXPECT_EQ(run(login.admit({"bad", "10.0.0.1"})).reason(), Reason::UNAUTHENTICATED);
  EXPECT_EQ(asked_, 1);
  EXPECT_TRUE(run(login.admit({"bert", "10.0.0.1"})).ok());
  now_ += 3600;
  EXPECT_TRUE(run(login.admit({"bert", "10.0.0.1"})).ok());
  EXPECT_EQ(asked_, 2) << "the daemon judges the calls themselves";
  EXPECT_TRUE(run(login.admit({"anna"})).ok()) << "of a session, which has logged in";
  EXPECT_EQ(asked_, 2);
  away_ = true;
  EXPECT_TRUE(run(login.admit({"carl", "10.0.0.1"})).ok()) << "the call itself says that the daemon is away";
}

TEST_F(LoginTest, AfterATokenWasRevokedItsOwnerCanLogInAgain) {
  Login login = make(Login::Kind::kToken);
  const std::string id = log_in(login, "bert");
  roles_.erase("bert");
  roles_["bert2"] = "reader";
  now_ += 20;
  // An open page goes on asking.
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(ask_for(login, cookie(id)).reason(), Reason::UNAUTHENTICATED);
    EXPECT_EQ(ask_for(login, bearer("bert")).reason(), Reason::UNAUTHENTICATED);
  }
  log_in(login, "bert2");
}

TEST_F(LoginTest, WhoWasLetInSeesWhatIsInMemoryWhileTheDaemonIsAway) {
  Login login = make(Login::Kind::kToken);
  const std::string anna = log_in(login, "anna"), bert = log_in(login, "bert");
  away_ = true;
  now_ += 16;
  EXPECT_TRUE(ask_for(login, cookie(anna)).ok());
  EXPECT_EQ(ask_for(login, bearer("carl")).reason(), Reason::UNREACHABLE) << "who never was";
  asked_ = 0;
  for (int i = 0; i < 14; ++i, ++now_) EXPECT_TRUE(ask_for(login, cookie(anna)).ok());
  EXPECT_EQ(asked_, 0) << "nobody waits for it each time";
  now_ += 14 * 60;
  EXPECT_TRUE(ask_for(login, cookie(anna)).ok());
  now_ += 31;
  EXPECT_EQ(ask_for(login, cookie(anna)).reason(), Reason::UNREACHABLE) << "after 15 minutes";
  away_ = false;
  EXPECT_TRUE(ask_for(login, cookie(anna)).ok());
  EXPECT_TRUE(ask_for(login, cookie(bert)).ok());

  // Never once the daemon has refused him, whichever call it was.
  roles_.erase("anna");
  now_ += 16;
  EXPECT_EQ(ask_for(login, cookie(anna)).reason(), Reason::UNAUTHENTICATED);
  login.refused("bert");
  away_ = true;
  EXPECT_EQ(ask_for(login, bearer("anna")).reason(), Reason::UNREACHABLE);
  EXPECT_EQ(ask_for(login, cookie(bert)).reason(), Reason::UNAUTHENTICATED);
  EXPECT_EQ(ask_for(login, bearer("bert")).reason(), Reason::UNREACHABLE);
}

TEST_F(LoginTest, TheConsoleAsksWithATokenWhoseSessionExists) {
  Login login = make(Login::Kind::kToken);
  EXPECT_EQ(login.last_let_in().reason(), Reason::UNAUTHENTICATED);
  const std::string anna = log_in(login, "anna"), bert = log_in(login, "bert");
  EXPECT_EQ(login.last_let_in()->token, "bert");
  EXPECT_TRUE(ask_for(login, cookie(anna)).ok());
  EXPECT_EQ(login.last_let_in()->token, "bert") << "not now one and now the other";
  post(login, "/logout", cookie(bert));
  EXPECT_EQ(login.last_let_in()->token, "anna");
  log_in(login, "bert");
  roles_["bert"] = "none";
  now_ += 16;
  EXPECT_EQ(authorise(login, {"bert"}).reason(), Reason::NOT_ALLOWED);
  EXPECT_EQ(login.last_let_in()->token, "anna");
  login.refused("anna");
  EXPECT_EQ(login.last_let_in().reason(), Reason::UNAUTHENTICATED);

  // Of a script, which has no session, for a while.
  EXPECT_TRUE(ask_for(login, bearer("anna")).ok());
  EXPECT_EQ(login.last_let_in()->token, "anna");
  now_ += 15 * 60 + 1;
  EXPECT_EQ(login.last_let_in().reason(), Reason::UNAUTHENTICATED);
  EXPECT_TRUE(make(Login::Kind::kKey).last_let_in().ok());
}

TEST_F(LoginTest, KnowsWhoIsAnOperator) {
  Login login = make(Login::Kind::kToken);
  EXPECT_FALSE(login.is_operator({"anna"})) << "the daemon has not said so yet";
  EXPECT_TRUE(authorise(login, {"anna"}).ok());
  EXPECT_TRUE(authorise(login, {"bert"}).ok());
  EXPECT_TRUE(login.is_operator({"anna"}));
  EXPECT_FALSE(login.is_operator({"bert"}));
  EXPECT_TRUE(make(Login::Kind::kKey).is_operator({}));
  EXPECT_TRUE(make(Login::Kind::kNone).is_operator({}));
}

}  // namespace
}  // namespace relmap::console
