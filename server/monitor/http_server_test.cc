#include "server/monitor/http_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/rpc/testing/fleet_credentials.h"

namespace relmap::monitor {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using tcp = asio::ip::tcp;
using Answer = http::response<http::string_body>;
using ::testing::HasSubstr;

// An address of this machine that is not a loopback address; empty: it has none.
std::string outer_address() {
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return "";
  std::string found;
  for (const ifaddrs* one = list; one && found.empty(); one = one->ifa_next)
    if (one->ifa_addr && one->ifa_addr->sa_family == AF_INET && (one->ifa_flags & IFF_LOOPBACK) == 0)
      found = asio::ip::make_address_v4(ntohl(reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr.s_addr))
                  .to_string();
  freeifaddrs(list);
  return found;
}

class HttpServerTest : public ::testing::Test {
 protected:
  HttpServerTest() { EXPECT_TRUE(gatekeeper_.reload().ok()); }

  void start(HttpOptions options = {}) {
    server_ = HttpServer::start(options, gatekeeper_, [this](std::string_view path) -> HttpPage {
                ++asked_;
                if (path == "/livez") return {200, "ok\n"};
                if (path == "/slow") {
                  std::unique_lock lock(mutex_);
                  changed_.wait(lock, [this] { return let_go_; });
                  return {200, "slow\n"};
                }
                if (path == "/throws") throw std::bad_alloc();
                return {404, "no " + std::string(path) + "\n"};
              }).or_throw();
  }
  void let_go() {
    const std::lock_guard lock(mutex_);
    let_go_ = true;
    changed_.notify_all();
  }

  tcp::socket connect(const std::string& host = "127.0.0.1") {
    tcp::socket socket(io_);
    socket.connect({asio::ip::make_address(host), server_->port()});
    return socket;
  }
  template <typename Stream>
  static Answer ask(Stream& stream, const std::string& path, const std::string& token = "",
                    http::verb verb = http::verb::get) {
    http::request<http::string_body> request(verb, path, 11);
    request.set(http::field::host, "map");
    if (!token.empty()) request.set(http::field::authorization, "Bearer " + token);
    http::write(stream, request);
    http::response_parser<http::string_body> parser;
    parser.skip(verb == http::verb::head);
    beast::flat_buffer buffer;
    http::read(stream, buffer, parser);
    return parser.release();
  }
  Answer get(const std::string& path) {
    auto socket = connect();
    return ask(socket, path);
  }
  // Over TLS, as the caller that these credentials tell.
  Answer get_by_tls(const std::string& host, const access::Credentials& shown) {
    asio::ssl::context context(asio::ssl::context::tls_client);
    context.add_certificate_authority(asio::buffer(shown.authorities));
    context.set_verify_mode(asio::ssl::verify_peer);
    if (!shown.certificate.empty()) {
      context.use_certificate_chain(asio::buffer(shown.certificate));
      context.use_private_key(asio::buffer(shown.key), asio::ssl::context::pem);
    }
    asio::ssl::stream<tcp::socket> stream(connect(host), context);
    stream.handshake(asio::ssl::stream_base::client);
    return ask(stream, "/livez", shown.token);
  }

  rpc::FleetCredentials fleet_;
  rpc::Gatekeeper gatekeeper_{fleet_.file("access")};
  asio::io_context io_;
  std::atomic<int> asked_ = 0;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool let_go_ = false;
  std::unique_ptr<HttpServer> server_;
};

TEST_F(HttpServerTest, ServesItsPages) {
  start();
  EXPECT_FALSE(server_->uses_tls());
  auto socket = connect();
  for (int i = 0; i < 3; ++i) {  // over one connection
    const Answer answer = ask(socket, "/livez?verbose");
    EXPECT_EQ(answer.result_int(), 200u);
    EXPECT_EQ(answer.body(), "ok\n");
    EXPECT_EQ(answer[http::field::cache_control], "no-store");
  }
  const Answer head = ask(socket, "/livez", "", http::verb::head);
  EXPECT_EQ(head[http::field::content_length], "3");
  EXPECT_EQ(ask(socket, "/other").result_int(), 404u);
  const Answer post = ask(socket, "/livez", "", http::verb::post);
  EXPECT_EQ(post.result_int(), 405u);
  EXPECT_EQ(post[http::field::allow], "GET, HEAD");
}

TEST_F(HttpServerTest, APageThatCannotBeMadeHasAReason) {
  start();
  const Answer answer = get("/throws");
  EXPECT_EQ(answer.result_int(), 500u);
  EXPECT_THAT(answer.body(), HasSubstr("BUDGET_EXCEEDED"));
  EXPECT_EQ(get("/livez").result_int(), 200u);
}

TEST_F(HttpServerTest, APageThatTakesLongKeepsNoOtherWaiting) {
  start();
  auto slow = std::thread([&] { EXPECT_EQ(get("/slow").body(), "slow\n"); });
  while (asked_ == 0) std::this_thread::yield();
  EXPECT_EQ(get("/livez").body(), "ok\n");
  let_go();
  slow.join();
}

TEST_F(HttpServerTest, ConnectionsThatSayNothingMakeRoom) {
  start();
  std::vector<tcp::socket> silent;
  for (int i = 0; i < 200; ++i) silent.push_back(connect());
  EXPECT_EQ(get("/livez").body(), "ok\n");
  char byte;
  beast::error_code error;
  silent.front().read_some(asio::buffer(&byte, 1), error);
  EXPECT_TRUE(error) << "the oldest was closed";
}

TEST_F(HttpServerTest, WhatIsNoRequestEndsTheConnectionAndNothingElse) {
  start();
  for (const std::string& nonsense :
       {std::string("\x16\x03\x01\x02\x00\x01", 6), std::string("GET /livez HTTP/9.9\r\n\r\n"),
        "GET /" + std::string(20000, 'a') + " HTTP/1.1\r\n\r\n", std::string("\0\0\0\0\r\n\r\n", 8),
        std::string("POST /livez HTTP/1.1\r\nContent-Length: 99999999\r\n\r\n")}) {
    auto socket = connect();
    beast::error_code error;
    asio::write(socket, asio::buffer(nonsense), error);
    char byte;
    while (!error) socket.read_some(asio::buffer(&byte, 1), error);
  }
  EXPECT_EQ(get("/livez").body(), "ok\n");
}

TEST_F(HttpServerTest, BeyondThisMachineCallersNeedCredentials) {
  const std::string outer = outer_address();
  ASSERT_NE(outer, "") << "this test needs a network interface besides the loopback";
  const access::Credentials reader = fleet_.token(access::Role::kReader, "prometheus"),
                            robot = fleet_.certificate(access::Role::kRobot, "cart");
  ASSERT_TRUE(gatekeeper_.reload().ok());
  start({"0.0.0.0", 0, fleet_.tls()});
  EXPECT_TRUE(server_->uses_tls());
  EXPECT_EQ(get_by_tls(outer, reader).result_int(), 200u);
  EXPECT_EQ(get_by_tls(outer, robot).result_int(), 200u) << "any role";
  access::Credentials nothing = reader, wrong = reader;
  nothing.token.clear();
  wrong.token = access::new_token();
  const Answer refused = get_by_tls(outer, nothing);
  EXPECT_EQ(refused.result_int(), 401u);
  EXPECT_EQ(refused[http::field::www_authenticate], "Bearer");
  EXPECT_THAT(refused.body(), HasSubstr("UNAUTHENTICATED"));
  EXPECT_EQ(get_by_tls(outer, wrong).result_int(), 401u);
  EXPECT_EQ(get_by_tls("127.0.0.1", nothing).result_int(), 200u) << "this machine itself";
  EXPECT_EQ(get("/livez").result_int(), 200u) << "this machine itself, without TLS";
  fleet_.revoke("prometheus");
  ASSERT_TRUE(gatekeeper_.reload().ok());
  EXPECT_EQ(get_by_tls(outer, reader).result_int(), 401u) << "revoked";
  EXPECT_ANY_THROW({
    auto plain = connect(outer);
    ask(plain, "/livez");
  }) << "without TLS nobody is answered";
  const rpc::FleetCredentials other;  // of another authority
  access::Credentials forged = const_cast<rpc::FleetCredentials&>(other).certificate(access::Role::kOperator, "eve");
  forged.authorities = reader.authorities;
  EXPECT_ANY_THROW(get_by_tls(outer, forged));
}

TEST_F(HttpServerTest, WithoutTlsOnlyThisMachineIsServedUnlessEveryoneMay) {
  const std::string outer = outer_address();
  ASSERT_NE(outer, "");
  start({"0.0.0.0", 0, {}});
  auto socket = connect(outer);
  EXPECT_EQ(ask(socket, "/livez").result_int(), 401u);
  EXPECT_EQ(get("/livez").result_int(), 200u);
  server_.reset();
  const rpc::Gatekeeper open({}, /*open=*/true);
  server_ = HttpServer::start({"0.0.0.0", 0, {}}, open, [](std::string_view) { return HttpPage{}; }).or_throw();
  auto free = connect(outer);
  EXPECT_EQ(ask(free, "/livez").result_int(), 200u);
}

TEST_F(HttpServerTest, NamesAPortInUse) {
  start();
  HttpOptions same;
  same.port = server_->port();
  EXPECT_EQ(HttpServer::start(same, gatekeeper_, [](std::string_view) { return HttpPage{}; }).reason(),
            Reason::PORT_IN_USE);
  EXPECT_EQ(HttpServer::start({"0.0.0.0", 0, {"/nowhere", "/nowhere", ""}}, gatekeeper_,
                              [](std::string_view) { return HttpPage{}; })
                .reason(),
            Reason::BAD_CONFIG);
}

}  // namespace
}  // namespace relmap::monitor
