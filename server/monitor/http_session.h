// One connection of the HTTP server. Internal to server/monitor.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "server/monitor/http_server.h"
#include "server/monitor/http_tls.h"

namespace relmap::monitor {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;

inline constexpr std::uint32_t kMaxHeader = 8192;
inline constexpr std::chrono::seconds kPatience{10};  // for a handshake, a request or its answer
inline constexpr std::chrono::seconds kIdle{60};      // between requests: longer than Prometheus waits between scrapes

struct Served {
  const rpc::Gatekeeper& gatekeeper;
  const HttpServer::Pages pages;
};

class Connection {
 public:
  virtual ~Connection() = default;
  virtual void close() = 0;  // from any thread
};

// One connection. Stream: beast::tcp_stream, or one of TLS over it.
template <typename Stream>
class Session final : public Connection, public std::enable_shared_from_this<Session<Stream>> {
 public:
  static constexpr bool kTls = !std::is_same_v<Stream, beast::tcp_stream>;

  template <typename... Arguments>
  Session(const Served& served, bool local, std::shared_ptr<asio::ssl::context> context, Arguments&&... arguments)
      : served_(served), local_(local), context_(std::move(context)), stream_(std::forward<Arguments>(arguments)...) {}

  // `begun`: what has been read of the connection already.
  void run(beast::flat_buffer begun = beast::flat_buffer(2 * kMaxHeader)) {
    buffer_ = std::move(begun);
    if constexpr (kTls) {
      lowest().expires_after(kPatience);
      stream_.async_handshake(asio::ssl::stream_base::server, buffer_.cdata(),
                              [self = this->shared_from_this()](beast::error_code error, std::size_t taken) {
                                self->buffer_.consume(taken);
                                if (!error) self->read(kPatience);
                              });
    } else {
      read(kPatience);
    }
  }

  void close() override {
    asio::post(stream_.get_executor(), [self = this->shared_from_this()] { self->lowest().close(); });
  }

 private:
  beast::tcp_stream& lowest() { return beast::get_lowest_layer(stream_); }

  void read(std::chrono::seconds patience) {
    parser_.emplace();
    parser_->header_limit(kMaxHeader);
    parser_->body_limit(kMaxHeader);  // none is read
    lowest().expires_after(patience);
    http::async_read(stream_, buffer_, *parser_,
                     [self = this->shared_from_this()](beast::error_code error, std::size_t) {
                       if (error) return self->end();
                       self->answer();
                     });
  }

  void answer() {
    const auto& request = parser_->get();
    HttpPage page;
    try {
      page = page_for(request);
    } catch (const std::exception&) {
      page = {500, caught_status().to_string() + "\n"};
    }
    response_ = {};
    response_.version(request.version());
    response_.result(page.status);
    response_.set(http::field::content_type, page.type);
    response_.set(http::field::cache_control, "no-store");
    response_.set("X-Content-Type-Options", "nosniff");
    if (page.status == 401) response_.set(http::field::www_authenticate, "Bearer");
    if (page.status == 405) response_.set(http::field::allow, "GET, HEAD");
    response_.keep_alive(request.keep_alive());
    response_.body() = std::move(page.body);
    response_.prepare_payload();
    if (request.method() == http::verb::head) response_.body().clear();  // its length was told
    lowest().expires_after(kPatience);
    serializer_.emplace(response_);
    const auto written = [self = this->shared_from_this(), more = request.keep_alive()](beast::error_code error,
                                                                                        std::size_t) {
      if (error || !more) return self->end();
      self->read(kIdle);
    };
    if (request.method() == http::verb::head)
      http::async_write_header(stream_, *serializer_, written);
    else
      http::async_write(stream_, *serializer_, written);
  }

  HttpPage page_for(const http::request<http::string_body>& request) {
    if (Status may = check_caller(request); !may.ok()) return {401, may.to_string() + "\n"};
    if (request.method() != http::verb::get && request.method() != http::verb::head)
      return {405, "pages can only be read\n"};
    const std::string_view target(request.target().data(), request.target().size());
    return served_.pages(target.substr(0, target.find('?')));
  }

  Status check_caller(const http::request<http::string_body>& request) {
    if (local_) return {};
    rpc::Evidence evidence;
    std::string certificate;
    if constexpr (kTls) {
      evidence.way = rpc::Evidence::Way::kTls;
      certificate = peer_certificate(stream_.native_handle());
    }
    const auto header = request[http::field::authorization];
    const std::string_view authorization(header.data(), header.size());
    evidence.certificate = certificate;
    constexpr std::string_view kBearer = "Bearer ";
    if (authorization.starts_with(kBearer)) evidence.token = authorization.substr(kBearer.size());
    return served_.gatekeeper.identify(evidence).status();
  }

  void end() {
    beast::error_code ignored;
    (void)lowest().socket().shutdown(asio::socket_base::shutdown_both, ignored);
    lowest().close();
  }

  const Served& served_;
  const bool local_;
  const std::shared_ptr<asio::ssl::context> context_;  // of the stream
  Stream stream_;
  beast::flat_buffer buffer_{2 * kMaxHeader};
  std::optional<http::request_parser<http::string_body>> parser_;
  http::response<http::string_body> response_;
  std::optional<http::response_serializer<http::string_body>> serializer_;
};

// A connection from this machine to a port of TLS: it may speak TLS or not.
class Either final : public Connection, public std::enable_shared_from_this<Either> {
 public:
  using Chosen = std::function<void(bool tls, asio::ip::tcp::socket, beast::flat_buffer begun)>;
  Either(asio::ip::tcp::socket socket, Chosen chosen) : stream_(std::move(socket)), chosen_(std::move(chosen)) {}

  void run() {
    stream_.expires_after(kPatience);
    beast::async_detect_ssl(stream_, buffer_, [self = this->shared_from_this()](beast::error_code error, bool tls) {
      if (!error) self->chosen_(tls, self->stream_.release_socket(), std::move(self->buffer_));
    });
  }
  void close() override {
    asio::post(stream_.get_executor(), [self = this->shared_from_this()] { self->stream_.close(); });
  }

 private:
  beast::tcp_stream stream_;
  const Chosen chosen_;
  beast::flat_buffer buffer_{2 * kMaxHeader};
};

}  // namespace relmap::monitor
