// One connection of the server. Internal to tools/console/http.
#pragma once

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/address.hpp>
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

// An address of IPv4 as such, where a socket of both kinds has it as one of IPv6.
inline asio::ip::address plain(const asio::ip::address& address) {
  return address.is_v6() && address.to_v6().is_v4_mapped()
             ? asio::ip::make_address_v4(asio::ip::v4_mapped, address.to_v6())
             : address;
}

class OpenConnection {
 public:
  explicit OpenConnection(const asio::ip::address& peer) : peer_(plain(peer)) {}
  virtual ~OpenConnection() = default;
  virtual void close() = 0;  // from any thread
  // Whether it waits for a request, or for the rest of a request's header. From any thread.
  bool idle() const { return idle_; }
  // Whether the last caller who was judged was let in. From any thread.
  bool proven() const { return proven_; }
  const asio::ip::address& peer() const { return peer_; }
  // What counts as one address: whoever has one of IPv6 has 64 bits of them.
  std::string peer_group() const {
    if (peer_.is_v4()) return peer_.to_string();
    auto bytes = peer_.to_v6().to_bytes();
    std::fill(bytes.begin() + 8, bytes.end(), std::uint8_t{0});
    return asio::ip::address_v6(bytes).to_string();
  }

 protected:
  std::atomic<bool> idle_{true}, proven_{false};

 private:
  const asio::ip::address peer_;
};

// The bytes of a body that have come and are held, within ServerOptions::max_bodies.
class BodyCharge {
 public:
  explicit BodyCharge(Served& served) : served_(served) {}
  ~BodyCharge() { give_back(); }
  BodyCharge(const BodyCharge&) = delete;
  BodyCharge& operator=(const BodyCharge&) = delete;
  // False, and nothing is added, if they do not fit.
  bool add(std::size_t bytes) {
    if ((served_.body_bytes += bytes) > served_.options.max_bodies) {
      served_.body_bytes -= bytes;
      return false;
    }
    bytes_ += bytes;
    return true;
  }
  void give_back() { served_.body_bytes -= std::exchange(bytes_, 0); }

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
  Connection(Served& served, std::shared_ptr<asio::ssl::context> context, const asio::ip::address& peer,
             Arguments&&... arguments)
      : OpenConnection(peer),
        served_(served),
        context_(std::move(context)),
        stream_(std::forward<Arguments>(arguments)...),
        charge_(served) {}

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

  void begin(Response head) override {
    head_ = std::move(head);
    charge_.give_back();
  }

  void let_in() override { proven_ = served_.gate.proves; }

  Awaitable<void> write(std::string bytes) override {
    lowest().expires_after(write_patience());
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
  using Parser = web::request_parser<web::buffer_body>;

  beast::tcp_stream& lowest() { return beast::get_lowest_layer(stream_); }
  std::chrono::milliseconds write_patience() const {
    return proven_ ? served_.options.write_patience : served_.options.unproven_write_patience;
  }

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
    charge_.give_back();
    Status status = admit(parser, request, match);
    if (status.ok() && match.route->access == Access::kAuthorised) status = co_await judge(request);
    if (status.ok() && !parser.is_done()) status = co_await read_body(parser, *match.route, request);
    if (!status.ok()) {
      // What may follow of the body is not read.
      if (!parser.is_done()) keep_alive_ = false;
      release_body(request);
      const Response refused = error_response(status);
      co_return co_await answer(refused, request);
    }
    lowest().expires_never();
    co_return co_await handle(*match.route, request);
  }

  // All that can be judged before the body is read.
  Status admit(const Parser& parser, Request& request, Router::Match& match) {
    const auto& header = parser.get();
    if (version_ != 10 && version_ != 11) return {Reason::INVALID_ARGUMENT, "this is not HTTP/1.1"};
    // Whoever frames a body in another way than we do could hide a request in it.
    if (header.count(web::field::transfer_encoding) > 0 &&
        (version_ != 11 || header.count(web::field::transfer_encoding) > 1 ||
         !beast::iequals(header[web::field::transfer_encoding], "chunked"))) {
      keep_alive_ = false;
      return {Reason::INVALID_ARGUMENT, "Transfer-Encoding may only be: chunked"};
    }
    for (const auto& field : header) {
      std::string name(field.name_string().data(), field.name_string().size());
      for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      const auto [entry, added] = request.headers.try_emplace(std::move(name), field.value());
      if (!added) entry->second += ", " + std::string(field.value());
    }
    beast::error_code ignored;
    request.peer = peer().to_string();
    request.tls = kTls;
    request.gone = [this] { return gone(); };
    const std::string own = plain(lowest().socket().local_endpoint(ignored).address()).to_string();
    const std::string_view host = request.header("host");
    if (Status known = served_.names.check_host(host, own); !known.ok()) return known;
    if (Status sound = parse_target(view(header.target()), request.path, request.query); !sound.ok()) return sound;
    request.method = head_only_ ? "GET" : std::string(header.method_string());
    auto found = served_.router.find(request.method, request.path);
    if (!found.ok()) return found.status();
    match = std::move(*found);
    request.parts = std::move(match.parts);
    if (!match.route->linked)
      if (Status own_site = check_fetch_site(request.header("sec-fetch-site")); !own_site.ok()) return own_site;
    if (request.method == "POST")
      if (Status own_page = served_.names.check_origin(request.header("origin"), host, kTls); !own_page.ok())
        return own_page;
    if (match.route->access != Access::kAnyone) {
      auto caller = served_.gate.identify(request);
      if (!caller.ok()) return caller.status();
      request.caller = std::move(*caller);
    }
    const std::size_t limit = body_limit(*match.route);
    const auto length = parser.content_length();
    if (length && *length > limit)
      return {Reason::BAD_SIZE,
              "the body has " + std::to_string(*length) + " bytes, and may have " + std::to_string(limit)};
    return {};
  }

  static std::size_t body_limit(const Route& route) {
    return route.access == Access::kAnyone ? std::min(route.body_limit, kMaxUnjudgedBody) : route.body_limit;
  }

  // Whether the gate lets the request's caller in.
  Awaitable<Status> judge(const Request& request) {
    Status status;
    try {
      status = co_await served_.gate.authorise(request.caller);
    } catch (const std::exception&) {
      status = caught_status();
    }
    if (status.ok()) let_in();
    if (status.reason() == Reason::UNAUTHENTICATED || status.reason() == Reason::NOT_ALLOWED) proven_ = false;
    co_return status;
  }

  // Reads the body as it comes, and counts what has come. Throws if nothing more comes.
  Awaitable<Status> read_body(Parser& parser, const Route& route, Request& request) {
    constexpr std::size_t kStep = 16 * 1024;
    const std::size_t limit = body_limit(route);
    // Of callers whom only the handler's call will show to be let in, no more is read than strangers may send.
    bool judged = route.access != Access::kCaller || limit <= kMaxUnjudgedBody;
    const bool known = proven_ || route.access == Access::kAuthorised;
    lowest().expires_after(known ? served_.options.body_patience : served_.options.unproven_body_patience);
    parser.body_limit(limit);
    const auto announced = static_cast<std::size_t>(parser.content_length().value_or(0));
    bool is_waiting = beast::iequals(parser.get()[web::field::expect], "100-continue");
    while (!parser.is_done()) {
      const std::size_t had = request.body.size();
      if (!judged && std::max(had + 1, announced) > kMaxUnjudgedBody) {
        if (Status let = co_await judge(request); !let.ok()) co_return let;
        judged = true;
        lowest().expires_after(served_.options.body_patience);
      }
      if (std::exchange(is_waiting, false)) {
        static constexpr std::string_view kGoOn = "HTTP/1.1 100 Continue\r\n\r\n";
        co_await asio::async_write(stream_, asio::const_buffer(kGoOn.data(), kGoOn.size()), asio::use_awaitable);
      }
      const std::size_t room = judged ? kStep : std::min(kStep, kMaxUnjudgedBody - had);
      request.body.resize(had + room);
      auto& into = parser.get().body();
      into.data = request.body.data() + had;
      into.size = room;
      beast::error_code error;
      co_await web::async_read_some(stream_, buffer_, parser, asio::redirect_error(asio::use_awaitable, error));
      const std::size_t got = room - parser.get().body().size;
      request.body.resize(had + got);
      if (error == web::error::body_limit)
        co_return Status(Reason::BAD_SIZE, "the body has more than " + std::to_string(limit) + " bytes");
      if (error && error != web::error::need_buffer) {
        if (nobody_is_there(error)) throw beast::system_error(error);
        co_return Status(Reason::INVALID_ARGUMENT, "the body cannot be read: " + error.message());
      }
      if (!charge_.add(got))
        co_return Status(Reason::BUDGET_EXCEEDED, "the console has no room for more requests of this size: try again");
    }
    co_return Status();
  }

  void release_body(Request& request) {
    request.body = std::string();
    charge_.give_back();
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
    release_body(request);
    if (response && response->status < 400 && route.access == Access::kCaller) let_in();
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
    lowest().expires_after(write_patience());
    if (head_only_) {
      web::response_serializer<web::string_body> serializer(message);
      co_await web::async_write_header(stream_, serializer, asio::use_awaitable);
    } else {
      co_await web::async_write(stream_, message, asio::use_awaitable);
    }
    co_return keep_alive_;
  }

  // Whether the error says that the other end has gone or says no more, so that nobody would read an answer.
  static bool nobody_is_there(const beast::error_code& error) {
    return error == web::error::end_of_stream || error == web::error::partial_message ||
           error == beast::error::timeout || error.category() == asio::error::get_system_category() ||
           error.category() == asio::error::get_misc_category();
  }

  // A header that cannot be read.
  Awaitable<bool> refuse_header(beast::error_code error) {
    if (nobody_is_there(error)) co_return false;
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
  BodyCharge charge_;
  Response head_;
};

}  // namespace relmap::console
