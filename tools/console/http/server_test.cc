// The server against those who would get in, hold it up, or break it.
#include "tools/console/http/server.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tools/console/http/testing/raw_browser.h"

namespace relmap::console {
namespace {

using testing::Answer;
using testing::RawBrowser;

Awaitable<Response> echo(const Request& request) {
  Response response;
  response.type = "text/plain";
  response.body = request.path + "\n" + request.body;
  response.etag = "\"mark\"";
  co_return response;
}

Awaitable<Response> secret(const Request& request) {
  Response response;
  response.body = "secret of " + request.caller.token;
  co_return response;
}

// What handlers have done.
struct Seen {
  std::atomic<int> written{0};   // chunks of endless answers
  std::atomic<int> cut_off{0};   // endless answers whose reader was given up
  std::atomic<int> judged{0};    // by the gate
  std::atomic<int> waiting{0};   // work that has begun and waits for `release`
  std::atomic<int> begun{0};     // work
  std::atomic<int> given_up{0};  // before it had begun
  std::promise<void> release;
  const std::shared_future<void> released = release.get_future().share();
};

// As many chunks of a megabyte as the reader takes.
Awaitable<std::optional<Response>> endless(ResponseStream& stream, Seen& seen, bool let_in) {
  stream.begin({});
  if (let_in) stream.let_in();
  try {
    for (;;) {
      co_await stream.write(std::string(std::size_t{1} << 20, 'x'));
      ++seen.written;
    }
  } catch (const std::exception&) {
    ++seen.cut_off;
    throw;
  }
}

Awaitable<std::optional<Response>> two_chunks(ResponseStream& stream) {
  stream.begin({});
  co_await stream.write("one");
  co_await stream.write("two");
  co_return std::nullopt;
}

// Begins its answer, and ends when its reader has gone.
Awaitable<std::optional<Response>> begins(ResponseStream& stream) {
  stream.begin({});
  co_await stream.write("begun");
  const std::function<bool()> gone = [&stream] { return stream.gone(); };
  co_await wait_until(gone, std::chrono::steady_clock::now() + std::chrono::hours(1));
  co_return std::nullopt;
}

Awaitable<Response> size_of_body(const Request& request) {
  Response response;
  response.body = std::to_string(request.body.size());
  co_return response;
}

// Work that waits, or not.
struct Works {
  Server* server;
  Seen* seen;
  Work kind;
  bool waits;
  Awaitable<Response> operator()(const Request& request) const {
    const std::function<void()> what = [this] {
      ++seen->begun;
      if (!waits) return;
      ++seen->waiting;
      seen->released.wait();
    };
    try {
      co_await server->work(kind, request, what);
    } catch (const StatusError&) {
      ++seen->given_up;
      throw;
    }
    co_return Response();
  }
};

void wait_for(const std::function<bool()>& done) {
  while (!done()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

// Of callers, the gate lets in those who say "good".
class ServerTest : public ::testing::Test {
 protected:
  void serve(ServerOptions options = {}) {
    server_ = Server::listen(options).or_throw();
    Router router;
    router.add({"GET", "/echo", Access::kAnyone, echo});
    router.add({"POST", "/echo", Access::kAnyone, echo});
    router.add({"GET", "/secret", Access::kCaller, secret});
    router.add({"GET", "/mine", Access::kAuthorised, echo});
    Route document{"GET", "/document", Access::kAnyone, echo};
    document.linked = true;
    router.add(std::move(document));
    Route call{"POST", "/call", Access::kCaller, size_of_body};
    call.body_limit = std::size_t{16} << 20;
    router.add(call);
    call.pattern = "/begins";
    call.handler = {};
    call.stream = [](Request& request, ResponseStream& to) {
      request.body = std::string();
      return begins(to);
    };
    router.add(std::move(call));
    for (const bool let_in : {false, true}) {
      Route stream{"GET", let_in ? "/followed" : "/endless", let_in ? Access::kCaller : Access::kAnyone};
      stream.stream = [this, let_in](Request&, ResponseStream& to) { return endless(to, seen_, let_in); };
      router.add(std::move(stream));
    }
    Route two{"GET", "/two", Access::kAnyone};
    two.stream = [](Request&, ResponseStream& to) { return two_chunks(to); };
    router.add(std::move(two));
    router.add({"GET", "/breaks", Access::kAnyone, [](const Request&) -> Awaitable<Response> {
                  throw StatusError({Reason::NO_SUCH_FRAME, "none"});
                }});
    for (const bool waits : {false, true}) {
      const std::string ending = waits ? "/waits" : "/at_once";
      router.add(
          {"GET", "/computes" + ending, Access::kAuthorised, Works{server_.get(), &seen_, Work::kComputes, waits}});
      router.add(
          {"GET", "/asks" + ending, Access::kAuthorised, Works{server_.get(), &seen_, Work::kAsksDaemon, waits}});
    }
    server_->serve(std::move(router), {[](const Request& request) -> Result<Caller> {
                                         if (request.header("authorization").empty())
                                           return Status(Reason::UNAUTHENTICATED, "nobody");
                                         return Caller{std::string(request.header("authorization"))};
                                       },
                                       [this](const Caller& caller) -> Awaitable<Status> {
                                         ++seen_.judged;
                                         if (caller.token == "good") co_return Status();
                                         co_return Status(Reason::UNAUTHENTICATED, "a stranger");
                                       }});
  }
  void TearDown() override {
    seen_.release.set_value();
    if (server_) server_->stop();
  }

  std::string host() const { return "Host: localhost:" + std::to_string(server_->port()) + "\r\n"; }
  std::string origin() const { return "Origin: http://localhost:" + std::to_string(server_->port()) + "\r\n"; }
  Answer ask(const std::string& text) { return RawBrowser(server_->port()).send(text).answer(); }
  std::string get(const std::string& path, const std::string& more = "") const {
    return "GET " + path + " HTTP/1.1\r\n" + host() + more + "\r\n";
  }
  // The header of a POST by `who`; `size`: how its body is framed.
  std::string post(const std::string& path, const std::string& who, const std::string& size) const {
    return "POST " + path + " HTTP/1.1\r\n" + host() + origin() + "Authorization: " + who + "\r\n" + size + "\r\n\r\n";
  }
  std::string posted(const std::string& path, const std::string& who, std::size_t bytes) const {
    return post(path, who, length(bytes)) + std::string(bytes, 'x');
  }
  static std::string length(std::size_t bytes) { return "Content-Length: " + std::to_string(bytes); }

  Seen seen_;
  std::unique_ptr<Server> server_;
};

constexpr char kGood[] = "Authorization: good\r\n";

TEST_F(ServerTest, AnswersWithSecurityHeaders) {
  serve();
  const Answer answer = ask(get("/echo"));
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.body, "/echo\n");
  EXPECT_NE(answer.headers.at("content-security-policy").find("default-src 'none'"), std::string::npos);
  EXPECT_EQ(answer.headers.at("content-security-policy").find("unsafe"), std::string::npos);
  EXPECT_EQ(answer.headers.at("x-content-type-options"), "nosniff");
  EXPECT_EQ(answer.headers.at("referrer-policy"), "no-referrer");
  EXPECT_EQ(answer.headers.at("cross-origin-resource-policy"), "same-origin");
  EXPECT_EQ(ask("GET /echo HTTP/1.1\r\n" + host() + "If-None-Match: \"mark\"\r\n\r\n").status, 304);
}

TEST_F(ServerTest, RefusesOtherHostsAndOrigins) {
  serve();
  for (const std::string other : {"Host: evil.example\r\n", "", "Host: localhost\r\nHost: evil.example\r\n"})
    EXPECT_GE(ask("GET /echo HTTP/1.1\r\n" + other + "\r\n").status, 400) << other;
  const std::string body = "Content-Length: 2\r\n\r\nhi";
  EXPECT_EQ(ask("POST /echo HTTP/1.1\r\n" + host() + origin() + body).body, "/echo\nhi");
  EXPECT_EQ(ask("POST /echo HTTP/1.1\r\n" + host() + body).status, 403);
  EXPECT_EQ(ask("POST /echo HTTP/1.1\r\n" + host() + "Origin: null\r\n" + body).status, 403);
  EXPECT_EQ(ask("POST /echo HTTP/1.1\r\n" + host() + "Origin: http://evil.example\r\n" + body).status, 403);
}

TEST_F(ServerTest, RefusesWhatIsTooLargeOrNoRequest) {
  serve();
  const std::string much(17 * 1024, 'a');
  EXPECT_EQ(ask("GET /echo HTTP/1.1\r\n" + host() + "X: " + much + "\r\n\r\n").status, 431);
  EXPECT_EQ(ask("GET /" + much + " HTTP/1.1\r\n" + host() + "\r\n").status, 431);
  const std::string post = "POST /echo HTTP/1.1\r\n" + host() + origin();
  EXPECT_EQ(ask(post + "Content-Length: 65537\r\n\r\n").status, 413);
  EXPECT_EQ(
      ask(post + "Transfer-Encoding: chunked\r\n\r\n10001\r\n" + std::string(0x10001, 'a') + "\r\n0\r\n\r\n").status,
      413);
  EXPECT_EQ(ask(post + "Transfer-Encoding: chunked\r\n\r\nzz\r\n").status, 400);
  EXPECT_EQ(ask(post + "Content-Length: 3\r\nContent-Length: 4\r\n\r\nabcd").status, 400);
  EXPECT_EQ(ask(post + "Content-Length: 3\r\nTransfer-Encoding: chunked\r\n\r\nabc").status, 400)
      << "request smuggling";
  EXPECT_EQ(ask("nonsense\r\n\r\n").status, 400);
  EXPECT_EQ(ask("DELETE /echo HTTP/1.1\r\n" + host() + "\r\n").status, 405);
  for (const std::string path : {"/../../etc/passwd", "/%2e%2e/etc/passwd", "//etc/passwd", "/echo/../secret"})
    EXPECT_EQ(ask(get(path)).status, 404) << path;
  EXPECT_EQ(ask(get("http://evil.example/echo")).status, 400);
  EXPECT_EQ(ask(get("/breaks")).body, R"({"reason":"NO_SUCH_FRAME","message":"none"})");
  EXPECT_EQ(ask(get("/secret")).status, 401);
  EXPECT_EQ(ask("GET /secret HTTP/1.1\r\n" + host() + "Authorization: me\r\n\r\n").body, "secret of me");
}

TEST_F(ServerTest, AnswersPipelinedRequestsInOrder) {
  serve();
  RawBrowser browser(server_->port());
  browser.send("POST /echo HTTP/1.1\r\n" + host() + origin() +
               "Transfer-Encoding: chunked\r\n\r\n3\r\nabc\r\n2\r\nde\r\n0\r\n\r\n" + get("/two") + get("/echo"));
  EXPECT_EQ(browser.answer().body, "/echo\nabcde");
  const Answer two = browser.answer();
  EXPECT_EQ(two.body, "onetwo");
  EXPECT_TRUE(two.whole);
  EXPECT_EQ(browser.answer().body, "/echo\n");
}

TEST_F(ServerTest, LetsNobodyHoldItUpWithHalfAHeader) {
  ServerOptions options;
  options.header_patience = std::chrono::milliseconds(50);
  serve(options);
  RawBrowser slow(server_->port());
  slow.send("GET /echo HTTP/1.1\r\nHost: loc");
  EXPECT_TRUE(slow.is_closed());
  RawBrowser silent(server_->port());
  EXPECT_TRUE(silent.is_closed());
}

TEST_F(ServerTest, ReadsNoBodyThatIsFramedInAnotherWay) {
  serve();
  for (const std::string other : {"identity", "gzip, chunked", "chunked, identity", "xchunked", "chunked, chunked", "",
                                  "chunked\r\nTransfer-Encoding: chunked", "chunked\r\nTransfer-Encoding: gzip"}) {
    RawBrowser browser(server_->port());
    browser.send("POST /echo HTTP/1.1\r\n" + host() + origin() + "Transfer-Encoding: " + other + "\r\n\r\n" +
                 get("/echo"));
    EXPECT_EQ(browser.answer().status, 400) << other;
    EXPECT_EQ(browser.answer().status, 0) << "a request was hidden in a body: " << other;
  }
  EXPECT_EQ(ask("POST /echo HTTP/1.1\r\n" + host() + origin() + "Transfer-Encoding: Chunked\r\n\r\n0\r\n\r\n").status,
            200);
  EXPECT_EQ(ask("POST /echo HTTP/1.0\r\n" + host() + origin() + "Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n").status,
            400);
}

TEST_F(ServerTest, AnswersOtherSitesOnlyWithDocuments) {
  serve();
  for (const std::string other : {"cross-site", "same-site", "what"}) {
    EXPECT_EQ(ask(get("/echo", "Sec-Fetch-Site: " + other + "\r\n")).status, 403) << other;
    EXPECT_EQ(ask(get("/mine", kGood + ("Sec-Fetch-Site: " + other) + "\r\n")).status, 403) << other;
    EXPECT_EQ(ask(get("/document", "Sec-Fetch-Site: " + other + "\r\n")).status, 200) << other;
  }
  for (const std::string own : {"same-origin", "none"})
    EXPECT_EQ(ask(get("/echo", "Sec-Fetch-Site: " + own + "\r\n")).status, 200) << own;
}

TEST_F(ServerTest, IsAskedByItsAddressesOfBothKinds) {
  ServerOptions options;
  options.host = "::";
  const auto tried = Server::listen(options);
  if (!tried.ok()) GTEST_SKIP() << "there is no IPv6 here: " << tried.status().to_string();
  serve(options);
  const std::string asked = "GET /echo HTTP/1.1\r\nHost: 127.0.0.2:" + std::to_string(server_->port()) + "\r\n\r\n";
  EXPECT_EQ(RawBrowser(server_->port(), "127.0.0.2").send(asked).answer().status, 200);
}

TEST_F(ServerTest, AcceptsAgainOnceFilesAreFree) {
  serve();
  RawBrowser early(server_->port());
  EXPECT_EQ(early.send(get("/echo")).answer().status, 200);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  const int next = dup(STDERR_FILENO);
  close(next);
  rlimit few = before;
  few.rlim_cur = static_cast<rlim_t>(next) + 1;  // for the end of `late` here, and none for the server's
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
  RawBrowser late(server_->port());
  late.send(get("/echo"));
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(early.send(get("/echo")).answer().status, 200);
    EXPECT_FALSE(late.receive(std::chrono::milliseconds(50)));
  }
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_EQ(late.answer().status, 200);
}

TEST_F(ServerTest, ReadsOfStrangersNoMoreThanALittle) {
  ServerOptions options;
  options.max_bodies = std::size_t{1} << 20;
  options.unproven_body_patience = std::chrono::minutes(10);
  serve(options);
  // What they announce takes no room, nor what they send without an end.
  EXPECT_EQ(ask(post("/call", "stranger", length(std::size_t{16} << 20)) + "a little").status, 401);
  std::vector<std::unique_ptr<RawBrowser>> slow;
  for (int i = 0; i < 8; ++i) {
    slow.push_back(std::make_unique<RawBrowser>(server_->port()));
    slow.back()->send(post("/call", "stranger", i % 2 ? "Transfer-Encoding: chunked" : length(kMaxUnjudgedBody)));
    slow.back()->send(i % 2 ? "400\r\n" + std::string(1000, 'x') : "x");
  }
  EXPECT_EQ(ask(posted("/call", "good", 512 * 1024)).body, "524288");
  // As much as that is the handler's to refuse; not a byte more.
  EXPECT_EQ(ask(posted("/call", "stranger", kMaxUnjudgedBody)).body, std::to_string(kMaxUnjudgedBody));
  EXPECT_EQ(ask(posted("/call", "stranger", kMaxUnjudgedBody + 1)).status, 401);
  const std::string chunk = "8000\r\n" + std::string(0x8000, 'x') + "\r\n";
  const int judged = seen_.judged;
  EXPECT_EQ(ask(post("/call", "stranger", "Transfer-Encoding: chunked") + chunk + "1\r\nx\r\n0\r\n\r\n").body, "32769");
  EXPECT_EQ(seen_.judged, judged);
  EXPECT_EQ(ask(post("/call", "stranger", "Transfer-Encoding: chunked") + chunk + chunk + "1\r\nx\r\n").status, 401);
  EXPECT_EQ(seen_.judged, judged + 1);
  EXPECT_EQ(ask(post("/call", "good", "Transfer-Encoding: chunked") + chunk + chunk + chunk + "0\r\n\r\n").body,
            "98304");
  // Nor is anything more than that read where nobody is asked who he is.
  EXPECT_EQ(ask(posted("/echo", "good", kMaxUnjudgedBody + 1)).status, 413);
}

TEST_F(ServerTest, RefusesOnlyTheBodyThatDoesNotFit) {
  ServerOptions options;
  options.max_bodies = 300'000;
  serve(options);
  std::unique_ptr<RawBrowser> large;
  Answer other;
  do {  // until the server has read what comes first before the second
    large = std::make_unique<RawBrowser>(server_->port());
    large->send(post("/call", "good", length(250'000)) + std::string(200'000, 'x'));
    large->receive(std::chrono::milliseconds(200));
    other = ask(posted("/call", "good", 200'000));
  } while (other.status == 200);
  EXPECT_EQ(other.status, 503);
  EXPECT_NE(other.body.find("BUDGET_EXCEEDED"), std::string::npos);
  EXPECT_EQ(ask(posted("/call", "good", 1000)).body, "1000");
  EXPECT_EQ(large->send(std::string(50'000, 'x')).answer().body, "250000");
  EXPECT_EQ(ask(posted("/call", "good", 200'000)).body, "200000");
}

TEST_F(ServerTest, CountsNoBodyOfAStreamThatHasBegun) {
  ServerOptions options;
  options.max_bodies = 300'000;
  serve(options);
  RawBrowser stream(server_->port());
  stream.send(posted("/begins", "good", 250'000));
  EXPECT_EQ(stream.head().status, 200);
  EXPECT_EQ(*stream.chunk(), "begun");
  EXPECT_EQ(ask(posted("/call", "good", 250'000)).body, "250000");
}

TEST_F(ServerTest, HasLessPatienceWithStrangers) {
  ServerOptions options;
  options.unproven_body_patience = options.unproven_write_patience = std::chrono::milliseconds(50);
  serve(options);
  RawBrowser stranger(server_->port());
  EXPECT_TRUE(stranger.send(post("/call", "stranger", length(10)) + "x").is_closed());
  RawBrowser reader(server_->port());
  reader.send(get("/endless"));
  wait_for([&] { return seen_.cut_off == 1; });
  // Whoever was let in may take longer: by the gate, or by the daemon that answers him.
  for (const std::string path : {"/mine", "/secret"}) {
    RawBrowser slow(server_->port());
    EXPECT_EQ(slow.send(get(path, kGood)).answer().status, 200);
    slow.send(post("/call", "good", length(10)) + "x");
    EXPECT_FALSE(slow.receive(std::chrono::milliseconds(300)));
    EXPECT_EQ(slow.send("yyyyyyyyy").answer().body, "10");
  }
  RawBrowser follower(server_->port());
  follower.send(get("/followed", kGood));
  EXPECT_EQ(follower.head().status, 200);
  for (int before = -1; before != seen_.written; std::this_thread::sleep_for(std::chrono::milliseconds(300)))
    before = seen_.written;
  EXPECT_EQ(seen_.cut_off, 1);
}

TEST_F(ServerTest, ClosesStrangersOfTheAddressThatHasMostForOneMore) {
  ServerOptions options;
  options.max_connections = 5;
  options.unproven_write_patience = std::chrono::minutes(10);
  serve(options);
  RawBrowser proven(server_->port()), other(server_->port(), "127.0.0.1", "127.0.0.3");
  EXPECT_EQ(proven.send(get("/mine", kGood)).answer().status, 200);
  EXPECT_EQ(other.send(get("/echo")).answer().status, 200);
  std::vector<std::unique_ptr<RawBrowser>> many;
  const auto one_more = [&] {
    many.push_back(std::make_unique<RawBrowser>(server_->port(), "127.0.0.1", "127.0.0.2"));
    many.back()->send(get("/endless"));
    EXPECT_EQ(many.back()->head().status, 200);
  };
  for (int i = 0; i < 20; ++i) one_more();  // all busy
  wait_for([&] { return seen_.cut_off == 17; });
  RawBrowser late(server_->port(), "127.0.0.1", "127.0.0.4");
  EXPECT_EQ(late.send(get("/echo")).answer().status, 200);
  wait_for([&] { return seen_.cut_off == 18; });
  // None of the others was closed.
  for (RawBrowser* const one : {&proven, &other, &late}) EXPECT_EQ(one->send(get("/echo")).answer().status, 200);
}

// Among those who were let in, one that is being answered is not closed.
TEST_F(ServerTest, ClosesTheOldestThatWaitsForOneMore) {
  ServerOptions options;
  options.max_connections = 3;
  // Whoever has just been answered waits for a request a moment later, so the younger may be the first who does.
  bool oldest = false;
  for (int i = 0; i < 100 && !oldest; ++i) {
    serve(options);
    RawBrowser busy(server_->port());
    busy.send(get("/followed", kGood));
    EXPECT_EQ(busy.head().status, 200);
    RawBrowser waiting(server_->port()), later(server_->port());
    EXPECT_EQ(waiting.send(get("/mine", kGood)).answer().status, 200);
    EXPECT_EQ(later.send(get("/mine", kGood)).answer().status, 200);
    EXPECT_EQ(ask(get("/echo")).status, 200);
    oldest = later.send(get("/echo")).answer().status == 200;
    EXPECT_EQ(seen_.cut_off, 0);
    EXPECT_TRUE(!oldest || waiting.is_closed());
    server_->stop();  // before the busy one goes
  }
  EXPECT_TRUE(oldest);
}

TEST_F(ServerTest, ComputesWhileTheDaemonHangs) {
  serve();
  std::vector<std::unique_ptr<RawBrowser>> hanging;
  for (int i = 0; i < 20; ++i) {
    hanging.push_back(std::make_unique<RawBrowser>(server_->port()));
    hanging.back()->send(get("/asks/waits", kGood));
  }
  wait_for([&] { return seen_.judged == 20 && seen_.waiting > 0; });
  EXPECT_EQ(ask(get("/computes/at_once", kGood)).status, 200);
}

TEST_F(ServerTest, BeginsNoWorkOfABrowserThatHasGone) {
  serve();
  std::vector<std::unique_ptr<RawBrowser>> computing;
  for (int i = 0; i < 2; ++i) {
    computing.push_back(std::make_unique<RawBrowser>(server_->port()));
    computing.back()->send(get("/computes/waits", kGood));
  }
  wait_for([&] { return seen_.waiting == 2; });
  RawBrowser leaves(server_->port()), stays(server_->port());
  leaves.send(get("/computes/at_once", kGood));
  stays.send(get("/computes/at_once", kGood));
  wait_for([&] { return seen_.judged == 4; });
  leaves.close();
  wait_for([&] { return seen_.given_up == 1; });
  EXPECT_EQ(seen_.begun, 2);
  seen_.release.set_value();
  EXPECT_EQ(stays.answer().status, 200);
  EXPECT_EQ(seen_.begun, 3);
  seen_.release = {};  // for TearDown()
}

TEST_F(ServerTest, HoldsASlowReaderBackAndNobodyElse) {
  ServerOptions options;
  options.unproven_write_patience = std::chrono::minutes(10);
  serve(options);
  RawBrowser slow(server_->port());
  slow.send(get("/endless"));
  EXPECT_EQ(slow.head().status, 200);
  int before = -1;
  while (before != seen_.written) {  // until the buffers between the two are full
    before = seen_.written;
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  }
  EXPECT_LT(seen_.written, 64);
  EXPECT_EQ(ask(get("/echo")).status, 200);
  for (int i = 0; i < 8; ++i) EXPECT_EQ(slow.chunk()->size(), std::size_t{1} << 20);
  wait_for([&] { return seen_.written > before; });
}

}  // namespace
}  // namespace relmap::console
