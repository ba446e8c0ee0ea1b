// One connection of the server. Internal to tools/console/http.
#pragma once

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <atomic>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <cctype>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "tools/console/http/gzip.h"
#include "tools/console/http/server.h"

namespace relmap::console {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace web = boost::beast::http;

// What connections share.
struct Served {
  const ServerOptions& options;
  const Router& router;
  const Gate& gate;
  const OwnNames& names;
  std::atomic<std::size_t> body_bytes{0};
};

class OpenConnection {
 public:
  virtual ~OpenConnection() = default;
  virtual void close() = 0;  // from any thread
  // Whether it waits for a request, or for the rest of a request's header. From any thread.
  bool idle() const { return idle_; }

 protected:
  std::atomic<bool> idle_{true};
};

// The bytes of a body that is being received and handled, within ServerOptions::max_bodies.
class BodyCharge {
 public:
  explicit BodyCharge(Served& served) : served_(served) {}
  ~BodyCharge() { served_.body_bytes -= bytes_; }
  BodyCharge(const BodyCharge&) = delete;
  BodyCharge& operator=(const BodyCharge&) = delete;
  bool take(std::size_t bytes) {
    bytes_ = bytes;
    return (served_.body_bytes += bytes) <= served_.options.max_bodies;
  }

 private:
  Served& served_;
  std::size_t bytes_ = 0;
};

// Stream: beast::tcp_stream, or one of TLS over it. All of it runs on the strand of the stream.
template <typename Stream>
class Connection final : public OpenConnection,
                         public ResponseStream,
                         public std::enable_shared_from_this<Connection<Stream>> {
 public:
  static constexpr bool kTls = !std::is_same_v<Stream, beast::tcp_stream>;

  template <typename... Arguments>
  Connection(Served& served, std::shared_ptr<asio::ssl::context> context, Arguments&&... arguments)
      : served_(served), context_(std::move(context)), stream_(std::forward<Arguments>(arguments)...) {}

  auto executor() { return stream_.get_executor(); }

  // Serves until the connection is closed. `self` keeps the connection alive.
  static Awaitable<void> run(std::shared_ptr<Connection> self) {
    try {
      co_await self->handshake();
      for (bool more = true; more;) more = co_await self->serve_one();
      co_await self->end();
    } catch (const std::exception&) {  // the connection broke
    }
    beast::error_code ignored;
    (void)self->lowest().socket().close(ignored);
  }

  void close() override {
    asio::post(stream_.get_executor(), [self = this->shared_from_this()] { self->lowest().close(); });
  }

  void begin(Response head) override { head_ = std::move(head); }

  Awaitable<void> write(std::string bytes) override {
    lowest().expires_after(served_.options.write_patience);
    if (!begun_) {
      begun_ = true;
      web::response<web::empty_body> message;
      fill(message, head_);
      message.set("X-Accel-Buffering", "no");  // nginx would keep events back
      if (version_ >= 11) message.chunked(true);
      message.keep_alive(keep_alive_ && version_ >= 11);
      web::response_serializer<web::empty_body> serializer(message);
      co_await web::async_write_header(stream_, serializer, asio::use_awaitable);
    }
    if (bytes.empty()) co_return;
    if (version_ >= 11) {
      const auto chunk = web::make_chunk(asio::const_buffer(bytes.data(), bytes.size()));
      co_await asio::async_write(stream_, chunk, asio::use_awaitable);
    } else {
      co_await asio::async_write(stream_, asio::const_buffer(bytes.data(), bytes.size()), asio::use_awaitable);
    }
  }

  // Asked of the system, since whoever has closed a connection of TLS may have sent a last record before.
  bool gone() override {
    tcp_info info{};
    socklen_t size = sizeof info;
    if (getsockopt(lowest().socket().native_handle(), IPPROTO_TCP, TCP_INFO, &info, &size) != 0) return true;
    return info.tcpi_state != TCP_ESTABLISHED;
  }

 private:
  using Parser = web::request_parser<web::string_body>;

  beast::tcp_stream& lowest() { return beast::get_lowest_layer(stream_); }

  Awaitable<void> handshake() {
    if constexpr (kTls) {
      lowest().expires_after(served_.options.header_patience);
      co_await stream_.async_handshake(asio::ssl::stream_base::server, asio::use_awaitable);
    }
  }

  // Tells the other end that nothing comes any more, and gives it a moment to read what was sent: closing at once, with
  // bytes unread, would take the answer away again.
  Awaitable<void> end() {
    constexpr std::chrono::seconds kMoment{2};
    constexpr int kReads = 64;
    lowest().expires_after(kMoment);
    beast::error_code error;
    (void)lowest().socket().shutdown(asio::socket_base::shutdown_send, error);
    std::array<char, 16384> ignored{};
    for (int i = 0; i < kReads && !error; ++i)
      co_await lowest().async_read_some(asio::buffer(ignored), asio::redirect_error(asio::use_awaitable, error));
  }

  // Returns whether another request may follow.
  Awaitable<bool> serve_one() {
    begun_ = false;
    idle_ = true;
    beast::error_code error;
    if (buffer_.size() == 0) {
      constexpr std::size_t kFirst = 4096;
      lowest().expires_after(first_ ? served_.options.header_patience : served_.options.idle_patience);
      const auto room = buffer_.prepare(kFirst);
      const std::size_t got = co_await stream_.async_read_some(room, asio::redirect_error(asio::use_awaitable, error));
      if (error) co_return false;
      buffer_.commit(got);
    }
    first_ = false;
    Parser parser;
    parser.header_limit(Server::kMaxHeader);
    parser.body_limit(boost::none);  // by route, below
    lowest().expires_after(served_.options.header_patience);
    co_await web::async_read_header(stream_, buffer_, parser, asio::redirect_error(asio::use_awaitable, error));
    if (error) co_return co_await refuse_header(error);
    idle_ = false;
    const auto& header = parser.get();
    version_ = header.version();
    keep_alive_ = header.keep_alive();
    head_only_ = header.method() == web::verb::head;
    accepts_gzip_ = accepts(view(header[web::field::accept_encoding]), "gzip");

    Request request;
    Router::Match match;
    BodyCharge charge(served_);
    Status status = admit(parser, request, match, charge);
    if (status.ok()) status = co_await guard(authorise(*match.route, request));
    if (!status.ok()) {
      // What may follow of the body is not read.
      if (!parser.is_done()) keep_alive_ = false;
      const Response refused = error_response(status);
      co_return co_await answer(refused, request);
    }
    if (!parser.is_done()) {
      if (beast::iequals(header[web::field::expect], "100-continue")) {
        static constexpr std::string_view kGoOn = "HTTP/1.1 100 Continue\r\n\r\n";
        co_await asio::async_write(stream_, asio::const_buffer(kGoOn.data(), kGoOn.size()), asio::use_awaitable);
      }
      parser.body_limit(match.route->body_limit);
      lowest().expires_after(served_.options.body_patience);
      co_await web::async_read(stream_, buffer_, parser, asio::redirect_error(asio::use_awaitable, error));
      if (error) co_return co_await refuse_body(error, request, *match.route);
    }
    request.body = std::move(parser.get().body());
    lowest().expires_never();
    co_return co_await handle(*match.route, request);
  }

  // All that can be judged before the body is read.
  Status admit(const Parser& parser, Request& request, Router::Match& match, BodyCharge& charge) {
    const auto& header = parser.get();
    if (version_ != 10 && version_ != 11) return {Reason::INVALID_ARGUMENT, "this is not HTTP/1.1"};
    for (const auto& field : header) {
      std::string name(field.name_string().data(), field.name_string().size());
      for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      const auto [entry, added] = request.headers.try_emplace(std::move(name), field.value());
      if (!added) entry->second += ", " + std::string(field.value());
    }
    beast::error_code ignored;
    request.peer = lowest().socket().remote_endpoint(ignored).address().to_string();
    request.tls = kTls;
    const std::string own = lowest().socket().local_endpoint(ignored).address().to_string();
    const std::string_view host = request.header("host");
    if (Status known = served_.names.check_host(host, own); !known.ok()) return known;
    if (Status sound = parse_target(view(header.target()), request.path, request.query); !sound.ok()) return sound;
    request.method = head_only_ ? "GET" : std::string(header.method_string());
    auto found = served_.router.find(request.method, request.path);
    if (!found.ok()) return found.status();
    match = std::move(*found);
    request.parts = std::move(match.parts);
    if (request.method == "POST")
      if (Status own_page = served_.names.check_origin(request.header("origin"), host, kTls); !own_page.ok())
        return own_page;
    if (match.route->access != Access::kAnyone) {
      auto caller = served_.gate.identify(request);
      if (!caller.ok()) return caller.status();
      request.caller = std::move(*caller);
    }
    const std::size_t limit = match.route->body_limit;
    const auto length = parser.content_length();
    if (length && *length > limit)
      return {Reason::BAD_SIZE,
              "the body has " + std::to_string(*length) + " bytes, and may have " + std::to_string(limit)};
    if (!charge.take(parser.is_done() ? 0 : length ? static_cast<std::size_t>(*length) : limit))
      return {Reason::BUDGET_EXCEEDED, "the console has no room for more requests of this size: try again"};
    return {};
  }

  Awaitable<Status> authorise(const Route& route, const Request& request) {
    if (route.access != Access::kAuthorised) co_return Status();
    co_return co_await served_.gate.authorise(request.caller);
  }

  static Awaitable<Status> guard(Awaitable<Status> checked) {
    try {
      co_return co_await std::move(checked);
    } catch (const std::exception&) {
      co_return caught_status();
    }
  }

  Awaitable<bool> handle(const Route& route, Request& request) {
    std::optional<Response> response;
    try {
      if (route.handler)
        response = co_await route.handler(request);
      else
        response = co_await route.stream(request, *this);
    } catch (const std::exception&) {
      if (begun_) throw;  // the reader sees that the answer is cut off
      response = error_response(caught_status());
    }
    if (response) co_return co_await answer(*response, request);
    if (!begun_) co_await write("");
    if (version_ < 11) co_return false;
    co_await asio::async_write(stream_, web::make_chunk_last(), asio::use_awaitable);
    co_return keep_alive_;
  }

  Awaitable<bool> answer(const Response& response, const Request& request) {
    web::response<web::string_body> message;
    if (!response.etag.empty() && response.status == 200 &&
        request.header("if-none-match").find(response.etag) != std::string_view::npos) {
      fill(message, response);
      message.result(304);
      message.erase(web::field::content_type);
      message.erase(web::field::content_encoding);
    } else {
      fill(message, response);
      std::optional<std::string> packed;
      if (response.encoding.empty() && accepts_gzip_ && may_compress(response.type))
        packed = gzip(response.body, Effort::kQuick);
      if (packed) message.set(web::field::content_encoding, "gzip");
      message.body() = packed ? std::move(*packed) : response.body;
      message.prepare_payload();
    }
    message.keep_alive(keep_alive_);
    lowest().expires_after(served_.options.write_patience);
    if (head_only_) {
      web::response_serializer<web::string_body> serializer(message);
      co_await web::async_write_header(stream_, serializer, asio::use_awaitable);
    } else {
      co_await web::async_write(stream_, message, asio::use_awaitable);
    }
    co_return keep_alive_;
  }

  // A header that cannot be read.
  Awaitable<bool> refuse_header(beast::error_code error) {
    if (error == web::error::end_of_stream || error == beast::error::timeout ||
        error.category() == asio::error::get_system_category() ||
        error.category() == asio::error::get_misc_category() || error == web::error::partial_message)
      co_return false;  // nobody is there to read an answer
    const bool large = error == web::error::header_limit || error == web::error::buffer_overflow;
    Response response =
        error_response({large ? Reason::BAD_SIZE : Reason::INVALID_ARGUMENT,
                        large ? "the header has more than 16 kB" : "this is not HTTP/1.1: " + error.message()});
    if (large) response.status = 431;
    keep_alive_ = head_only_ = accepts_gzip_ = false;
    version_ = 11;
    const Request none;
    co_return co_await answer(response, none);
  }

  Awaitable<bool> refuse_body(beast::error_code error, const Request& request, const Route& route) {
    keep_alive_ = false;
    if (error == web::error::body_limit) {
      const Response large =
          error_response({Reason::BAD_SIZE, "the body has more than " + std::to_string(route.body_limit) + " bytes"});
      co_return co_await answer(large, request);
    }
    if (error == beast::error::timeout || error == web::error::partial_message ||
        error.category() == asio::error::get_system_category() || error.category() == asio::error::get_misc_category())
      co_return false;
    const Response bad = error_response({Reason::INVALID_ARGUMENT, "the body cannot be read: " + error.message()});
    co_return co_await answer(bad, request);
  }

  template <typename Message>
  void fill(Message& message, const Response& response) const {
    message.version(static_cast<unsigned>(version_ >= 11 ? 11 : 10));
    message.result(response.status);
    message.set(web::field::server, "relmap-console");
    message.set(web::field::content_type, response.type);
    message.set(web::field::cache_control, response.cache);
    // Nothing but the page's own files; styles and pictures that it makes itself.
    message.set("Content-Security-Policy",
                "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' blob: "
                "data:; worker-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
    message.set("X-Content-Type-Options", "nosniff");
    message.set("Referrer-Policy", "no-referrer");
    message.set("Cross-Origin-Opener-Policy", "same-origin");
    message.set("Cross-Origin-Resource-Policy", "same-origin");
    message.set(web::field::vary, "Accept-Encoding, Cookie");
    if (kTls) message.set("Strict-Transport-Security", "max-age=31536000");
    if (!response.etag.empty()) message.set(web::field::etag, response.etag);
    if (!response.encoding.empty()) message.set(web::field::content_encoding, response.encoding);
    if (response.status == 405) message.set(web::field::allow, "GET, HEAD, POST");
    for (const auto& [name, value] : response.headers) message.insert(name, value);
  }

  static std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

  Served& served_;
  const std::shared_ptr<asio::ssl::context> context_;  // of the stream; null: no TLS
  Stream stream_;
  beast::flat_buffer buffer_{2 * Server::kMaxHeader + 65536};
  bool first_ = true;  // no request has come yet
  // Of the present request.
  unsigned version_ = 11;
  bool keep_alive_ = true, head_only_ = false, accepts_gzip_ = false, begun_ = false;
  Response head_;
};

}  // namespace relmap::console
