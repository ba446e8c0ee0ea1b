// The server against those who would get in, hold it up, or break it.
#include "tools/console/http/server.h"

#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
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

// As many chunks of a megabyte as the reader takes.
Awaitable<std::optional<Response>> endless(ResponseStream& stream, std::atomic<int>& written) {
  stream.begin({});
  for (;;) {
    co_await stream.write(std::string(std::size_t{1} << 20, 'x'));
    ++written;
  }
}

Awaitable<std::optional<Response>> two_chunks(ResponseStream& stream) {
  stream.begin({});
  co_await stream.write("one");
  co_await stream.write("two");
  co_return std::nullopt;
}

class ServerTest : public ::testing::Test {
 protected:
  void serve(ServerOptions options = {}) {
    server_ = Server::listen(options).or_throw();
    Router router;
    router.add({"GET", "/echo", Access::kAnyone, echo});
    router.add({"POST", "/echo", Access::kAnyone, echo});
    router.add({"GET", "/secret", Access::kCaller, secret});
    Route stream{"GET", "/endless", Access::kAnyone};
    stream.stream = [this](Request&, ResponseStream& to) { return endless(to, written_); };
    router.add(std::move(stream));
    Route two{"GET", "/two", Access::kAnyone};
    two.stream = [](Request&, ResponseStream& to) { return two_chunks(to); };
    router.add(std::move(two));
    router.add({"GET", "/breaks", Access::kAnyone, [](const Request&) -> Awaitable<Response> {
                  throw StatusError({Reason::NO_SUCH_FRAME, "none"});
                }});
    server_->serve(std::move(router), {[](const Request& request) -> Result<Caller> {
                                         if (request.header("authorization").empty())
                                           return Status(Reason::UNAUTHENTICATED, "nobody");
                                         return Caller{std::string(request.header("authorization"))};
                                       },
                                       [](const Caller&) -> Awaitable<Status> { co_return Status(); }});
  }
  std::string host() const { return "Host: localhost:" + std::to_string(server_->port()) + "\r\n"; }
  std::string origin() const { return "Origin: http://localhost:" + std::to_string(server_->port()) + "\r\n"; }
  Answer ask(const std::string& text) { return RawBrowser(server_->port()).send(text).answer(); }
  std::string get(const std::string& path) const { return "GET " + path + " HTTP/1.1\r\n" + host() + "\r\n"; }

  std::atomic<int> written_{0};
  std::unique_ptr<Server> server_;
};

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

TEST_F(ServerTest, ClosesTheOldestThatWaitsForOneMore) {
  ServerOptions options;
  options.max_connections = 3;
  serve(options);
  RawBrowser busy(server_->port());
  busy.send(get("/endless"));
  EXPECT_EQ(busy.head().status, 200);
  RawBrowser waiting(server_->port()), later(server_->port());
  EXPECT_EQ(waiting.send(get("/echo")).answer().status, 200);
  EXPECT_EQ(later.send(get("/echo")).answer().status, 200);
  EXPECT_EQ(ask(get("/echo")).status, 200);
  EXPECT_TRUE(waiting.is_closed());
}

TEST_F(ServerTest, HoldsASlowReaderBackAndNobodyElse) {
  serve();
  RawBrowser slow(server_->port());
  slow.send(get("/endless"));
  EXPECT_EQ(slow.head().status, 200);
  int before = -1;
  while (before != written_) {  // until the buffers between the two are full
    before = written_;
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  }
  EXPECT_LT(written_, 64);
  EXPECT_EQ(ask(get("/echo")).status, 200);
  for (int i = 0; i < 8; ++i) EXPECT_EQ(slow.chunk()->size(), std::size_t{1} << 20);
  while (written_ <= before) std::this_thread::sleep_for(std::chrono::milliseconds(10));
}

}  // namespace
}  // namespace relmap::console
