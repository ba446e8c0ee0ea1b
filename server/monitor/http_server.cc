#include "server/monitor/http_server.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/strand.hpp>
#include <boost/beast/core.hpp>
#include <chrono>
#include <deque>
#include <thread>
#include <utility>
#include <vector>

#include "proto/base/mutex.h"
#include "server/monitor/http_session.h"
#include "server/rpc/listener.h"

namespace relmap::monitor {

namespace {

using tcp = asio::ip::tcp;
using Error = beast::error_code;

constexpr std::size_t kMaxConnections = 32;       // from this machine, and again from elsewhere
constexpr std::chrono::milliseconds kPause{100};  // where nothing can be accepted
constexpr int kThreads = 3;                       // so that neither a page that takes long nor handshakes of strangers
                                                  // keep others waiting

}  // namespace

struct HttpServer::Impl {
  Impl(const rpc::Gatekeeper& gatekeeper, Pages pages) : served{gatekeeper, std::move(pages)} {}

  void accept(tcp::acceptor& acceptor) {
    acceptor.async_accept(asio::make_strand(io), [this, &acceptor](Error error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (!error) serve(std::move(socket));
      if (error) std::this_thread::sleep_for(kPause);  // no file is free, for example
      accept(acceptor);
    });
  }

  void serve(tcp::socket socket) try {
    const bool local = rpc::is_of_this_machine(socket.native_handle());
    if (!tls || !local) return begin(tls != nullptr, std::move(socket), local, {});
    const auto either =
        std::make_shared<Either>(std::move(socket), [this](bool speaks_tls, tcp::socket chosen, auto begun) {
          begin(speaks_tls, std::move(chosen), /*local=*/true, std::move(begun));
        });
    admit(either, local);
    either->run();
  } catch (const std::exception&) {
    spdlog::error("HTTP: a connection is not served: {}", caught_status().to_string());
  }

  // `begun`: what has been read of it already.
  void begin(bool by_tls, tcp::socket socket, bool local, beast::flat_buffer begun) {
    if (by_tls) {
      auto context = tls->now();
      const auto session = std::make_shared<Session<asio::ssl::stream<beast::tcp_stream>>>(served, local, context,
                                                                                           std::move(socket), *context);
      admit(session, local);
      session->run(std::move(begun));
    } else {
      const auto session = std::make_shared<Session<beast::tcp_stream>>(served, local, nullptr, std::move(socket));
      admit(session, local);
      session->run(std::move(begun));
    }
  }

  // Makes room for it.
  void admit(const std::shared_ptr<Connection>& connection, bool local) {
    std::shared_ptr<Connection> oldest;
    {
      const MutexLock lock(mutex);
      std::deque<std::weak_ptr<Connection>>& open = local ? from_here : from_elsewhere;
      std::erase_if(open, [](const auto& one) { return one.expired(); });
      if (open.size() >= kMaxConnections) {
        oldest = open.front().lock();
        open.pop_front();
      }
      open.push_back(connection);
    }
    if (oldest) oldest->close();
  }

  void run() {
    for (;;) {
      try {
        io.run();
        return;
      } catch (const std::exception&) {
        spdlog::error("HTTP: {}", caught_status().to_string());
      }
    }
  }

  const Served served;
  std::unique_ptr<TlsContext> tls;  // null: none
  std::uint16_t port = 0;
  asio::io_context io{kThreads};
  std::vector<std::unique_ptr<tcp::acceptor>> acceptors;
  Mutex mutex;
  std::deque<std::weak_ptr<Connection>> from_here RELMAP_GUARDED_BY(mutex);  // the oldest first
  std::deque<std::weak_ptr<Connection>> from_elsewhere RELMAP_GUARDED_BY(mutex);
  std::array<std::thread, kThreads> threads;
};

HttpServer::HttpServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::unique_ptr<HttpServer>> HttpServer::start(const HttpOptions& options, const rpc::Gatekeeper& gatekeeper,
                                                      Pages pages) {
  auto sockets = rpc::ListeningSocket::at_host(options.host, options.port);
  if (!sockets.ok()) return sockets.status();
  std::unique_ptr<HttpServer> server(new HttpServer(std::make_unique<Impl>(gatekeeper, std::move(pages))));
  Impl& impl = *server->impl_;
  impl.port = sockets->front().port();
  bool only_local = true;
  for (const rpc::ListeningSocket& socket : *sockets) {
    const int own = dup(socket.fd());
    if (own < 0) return Status(Reason::TOO_MANY_FILES, "no file is free for the port of HTTP");
    auto acceptor = std::make_unique<tcp::acceptor>(impl.io);
    Error error;
    (void)acceptor->assign(socket.is_v6() ? tcp::v6() : tcp::v4(), own, error);
    if (error) return Status(Reason::IO_ERROR, "HTTP: " + error.message());
    only_local = only_local && socket.is_local();
    impl.acceptors.push_back(std::move(acceptor));
  }
  if (!only_local && !options.tls.certificate.empty()) {
    impl.tls = std::make_unique<TlsContext>(options.tls);
    if (Status read = impl.tls->read(); !read.ok()) return read;
  }
  for (const auto& acceptor : impl.acceptors) impl.accept(*acceptor);
  for (std::thread& thread : impl.threads) thread = std::thread([&impl] { impl.run(); });
  return server;
}

HttpServer::~HttpServer() {
  impl_->io.stop();
  for (std::thread& thread : impl_->threads)
    if (thread.joinable()) thread.join();
}

std::uint16_t HttpServer::port() const { return impl_->port; }
bool HttpServer::uses_tls() const { return impl_->tls != nullptr; }

}  // namespace relmap::monitor
