#include "tools/console/http/server.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/v6_only.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <cctype>
#include <deque>
#include <exception>
#include <map>
#include <thread>

#include "proto/base/mutex.h"
#include "tools/console/http/connection.h"
#include "tools/console/http/tls_context.h"

namespace relmap::console {

namespace {

using tcp = asio::ip::tcp;
using Error = boost::system::error_code;

constexpr int kThreads = 3;
constexpr int kComputing = 2, kAsking = 8;        // threads for work
constexpr std::chrono::milliseconds kPause{100};  // where nothing can be accepted
constexpr std::chrono::milliseconds kLook{500};   // between looks whether a browser that waits for work is still there

// The names by which a browser may ask a server that listens at this host.
std::vector<std::string> names_of(const std::string& host, bool any) {
  std::vector<std::string> names{"localhost", "127.0.0.1", "::1"};
  std::string own = host;
  for (char& c : own) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (!any) names.push_back(std::move(own));
  std::array<char, 256> machine{};
  if (any && gethostname(machine.data(), machine.size() - 1) == 0) {
    const auto name = parse_host(machine.data());
    if (name.ok()) names.push_back(name->name);
  }
  return names;
}

// Which of them is closed where there is no room; null: none. `open`: the oldest first.
std::shared_ptr<OpenConnection> least_wanted(const std::vector<std::shared_ptr<OpenConnection>>& open) {
  std::map<std::string, std::size_t> strangers;  // by address
  for (const auto& one : open)
    if (!one->proven()) ++strangers[one->peer_group()];
  std::size_t most = 0;
  for (const auto& [address, count] : strangers) most = std::max(most, count);
  const auto found = std::find_if(open.begin(), open.end(), [&](const auto& one) {
    if (most == 0) return one->idle();
    // It may have been proven since they were counted.
    const auto counted = one->proven() ? strangers.end() : strangers.find(one->peer_group());
    return counted != strangers.end() && counted->second == most;
  });
  return found == open.end() ? nullptr : *found;
}

}  // namespace

struct Server::Impl {
  // Work that a handler waits for.
  struct Job {
    Job(asio::any_io_executor executor, std::function<void()> w) : wake(std::move(executor)), what(std::move(w)) {}

    asio::steady_timer wake;  // of the handler
    const std::function<void()> what;
    std::atomic<bool> taken{false};  // by the thread that begins it, or by the handler that gives it up
    // Touched by the handler's executor only.
    bool done = false;
    std::exception_ptr failed;
  };

  // Runs it on a thread for work, unless it was given up.
  static void run_job(const std::shared_ptr<Job>& job) {
    if (job->taken.exchange(true)) return;
    std::exception_ptr failed;
    try {
      job->what();
    } catch (...) {
      failed = std::current_exception();
    }
    asio::post(job->wake.get_executor(), [job, failed] {
      job->failed = failed;
      job->done = true;
      job->wake.cancel();
    });
  }

  // An acceptor, and the timer of its pauses.
  struct Listener {
    explicit Listener(asio::io_context& io) : acceptor(io), pause(io) {}

    tcp::acceptor acceptor;
    asio::steady_timer pause;
  };

  explicit Impl(ServerOptions given) : options(std::move(given)) {}

  void accept(Listener& listener) {
    listener.acceptor.async_accept(asio::make_strand(io), [this, &listener](Error error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (!error) {
        take(std::move(socket));
        accept(listener);
        return;
      }
      listener.pause.expires_after(kPause);  // no file is free, for example
      listener.pause.async_wait([this, &listener](Error ended) {
        if (!ended) accept(listener);
      });
    });
  }

  void take(tcp::socket socket) try {
    Error ignored;
    const auto peer = socket.remote_endpoint(ignored).address();
    (void)socket.set_option(tcp::no_delay(true), ignored);
    (void)socket.set_option(asio::socket_base::keep_alive(true), ignored);
    if (tls) {
      auto context = tls->now();
      start(std::make_shared<Connection<asio::ssl::stream<beast::tcp_stream>>>(*served, context, peer,
                                                                               std::move(socket), *context));
    } else {
      start(std::make_shared<Connection<beast::tcp_stream>>(*served, nullptr, peer, std::move(socket)));
    }
  } catch (const std::exception&) {  // memory ran out: the browser sees a closed connection
  }

  template <typename One>
  void start(std::shared_ptr<One> connection) {
    if (!admit(connection)) return;
    const auto executor = connection->executor();
    asio::co_spawn(executor, One::run(std::move(connection)), asio::detached);
  }

  // Makes room for it; false: every other one is proven and being answered.
  bool admit(const std::shared_ptr<OpenConnection>& connection) {
    std::vector<std::shared_ptr<OpenConnection>> held;  // until the mutex is free: some may end here
    std::shared_ptr<OpenConnection> leaves;
    {
      const MutexLock lock(mutex);
      std::erase_if(open, [](const auto& one) { return one.expired(); });
      if (open.size() >= options.max_connections) {
        for (const auto& one : open)
          if (auto there = one.lock()) held.push_back(std::move(there));
        leaves = least_wanted(held);
        if (!leaves && held.size() >= options.max_connections) return false;
        std::erase_if(open, [&](const auto& one) { return one.lock() == leaves; });
      }
      open.push_back(connection);
    }
    if (leaves) leaves->close();
    return true;
  }

  void run() {
    for (;;) {
      try {
        io.run();
        return;
      } catch (const std::exception&) {  // of one connection, which is gone
      }
    }
  }

  const ServerOptions options;
  std::unique_ptr<TlsFiles> tls;  // null: none
  std::unique_ptr<OwnNames> names;
  std::uint16_t port = 0;
  bool local = true;
  Router router;
  Gate gate;
  std::unique_ptr<Served> served;
  Mutex mutex;
  std::deque<std::weak_ptr<OpenConnection>> open RELMAP_GUARDED_BY(mutex);  // the oldest first
  // After what connections use: they are destroyed with it.
  asio::io_context io{kThreads};
  std::vector<std::unique_ptr<Listener>> listeners;
  asio::thread_pool computing{kComputing}, asking{kAsking};
  std::array<std::thread, kThreads> threads;
};

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::unique_ptr<Server>> Server::listen(const ServerOptions& options) {
  std::unique_ptr<Server> server(new Server(std::make_unique<Impl>(options)));
  Impl& impl = *server->impl_;
  if (!options.certificate.empty()) {
    impl.tls = std::make_unique<TlsFiles>(options.certificate, options.key);
    if (Status read = impl.tls->read(); !read.ok()) return read;
  }
  const auto failed = [&](const Error& error) {
    return Status(error == asio::error::address_in_use ? Reason::PORT_IN_USE : Reason::BAD_CONFIG,
                  "cannot listen on " + options.host + ":" + std::to_string(options.port) + ": " + error.message());
  };
  Error error;
  tcp::resolver resolver(impl.io);
  const auto found = resolver.resolve(options.host, "0", tcp::resolver::passive, error);
  if (error) return failed(error);
  impl.port = options.port;
  bool any = false;
  for (const auto& entry : found) {
    tcp::endpoint at = entry.endpoint();
    at.port(impl.port);
    auto listener = std::make_unique<Impl::Listener>(impl.io);
    tcp::acceptor& acceptor = listener->acceptor;
    (void)acceptor.open(at.protocol(), error);
    if (error) continue;  // no IPv6 on this machine, for example
    (void)acceptor.set_option(asio::socket_base::reuse_address(true), error);
    if (at.protocol() == tcp::v6()) (void)acceptor.set_option(asio::ip::v6_only(!at.address().is_unspecified()), error);
    (void)acceptor.bind(at, error);
    if (error == boost::system::errc::address_not_available ||
        (error == asio::error::address_in_use && impl.port != options.port))
      continue;  // IPv6 is switched off; or the port that the system chose for one address is taken at another
    if (!error) (void)acceptor.listen(asio::socket_base::max_listen_connections, error);
    if (error) return failed(error);
    impl.port = acceptor.local_endpoint(error).port();
    impl.local = impl.local && at.address().is_loopback();
    any = any || at.address().is_unspecified();
    impl.listeners.push_back(std::move(listener));
  }
  if (impl.listeners.empty()) return failed(make_error_code(boost::system::errc::address_not_available));
  impl.names = std::make_unique<OwnNames>(names_of(options.host, any), options.proxied);
  return server;
}

Server::~Server() { stop(); }

std::uint16_t Server::port() const { return impl_->port; }
bool Server::is_local() const { return impl_->local; }
bool Server::uses_tls() const { return impl_->tls != nullptr; }

Awaitable<void> Server::work(Work kind, const Request& request, std::function<void()> what) {
  const auto executor = co_await asio::this_coro::executor;
  const auto job = std::make_shared<Impl::Job>(executor, std::move(what));
  asio::post(kind == Work::kComputes ? impl_->computing : impl_->asking, [job] { Impl::run_job(job); });
  Error ignored;
  while (!job->done) {
    job->wake.expires_after(kLook);
    co_await job->wake.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
    if (!job->done && request.gone && request.gone() && !job->taken.exchange(true))
      throw StatusError({Reason::DEADLINE, "the browser has gone"});
  }
  if (job->failed) std::rethrow_exception(job->failed);
}

void Server::serve(Router router, Gate gate) {
  impl_->router = std::move(router);
  impl_->gate = std::move(gate);
  impl_->served.reset(new Served{impl_->options, impl_->router, impl_->gate, *impl_->names});
  for (const auto& listener : impl_->listeners) impl_->accept(*listener);
  for (std::thread& thread : impl_->threads) thread = std::thread([impl = impl_.get()] { impl->run(); });
}

void Server::stop() {
  impl_->io.stop();
  for (std::thread& thread : impl_->threads)
    if (thread.joinable()) thread.join();
  for (asio::thread_pool* const pool : {&impl_->computing, &impl_->asking}) pool->stop();
  for (asio::thread_pool* const pool : {&impl_->computing, &impl_->asking}) pool->join();
}

Awaitable<bool> wait_until(std::function<bool()> done, std::chrono::steady_clock::time_point until) {
  constexpr std::chrono::milliseconds kLook{50};
  asio::steady_timer timer(co_await asio::this_coro::executor);
  while (!done()) {
    if (std::chrono::steady_clock::now() >= until) co_return false;
    timer.expires_after(kLook);
    co_await timer.async_wait(asio::use_awaitable);
  }
  co_return true;
}

}  // namespace relmap::console
