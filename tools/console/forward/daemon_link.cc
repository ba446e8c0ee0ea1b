#include "tools/console/forward/daemon_link.h"

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/channel_arguments.h>
#include <grpcpp/support/client_callback.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <set>
#include <utility>

#include "client/channel.h"
#include "client/rpc_error.h"
#include "client/server_address.h"
#include "proto/base/mutex.h"

namespace relmap::console {

namespace asio = boost::asio;

namespace {

grpc::ByteBuffer buffer_of(std::string_view bytes) {
  const grpc::Slice slice(bytes.data(), bytes.size());
  return {&slice, 1};
}

std::string text_of(const grpc::ByteBuffer& buffer) {
  std::string text;
  std::vector<grpc::Slice> slices;
  if (!buffer.Dump(&slices).ok()) return text;
  text.reserve(buffer.Length());
  for (const grpc::Slice& slice : slices) text.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  return text;
}

// gRPC would end the process over a header that is none.
bool is_header_value(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

}  // namespace

// What a call's coroutine waits for. Touched on its strand only.
struct ForwardedCall::Shared {
  explicit Shared(asio::any_io_executor e) : executor(std::move(e)), wake(executor) {}
  const asio::any_io_executor executor;
  asio::steady_timer wake;
  bool read = false;  // the read that was begun has come back
  std::optional<std::string> message;
  std::optional<grpc::Status> ended;
  CallEnd end;
};

// All calls that gRPC has not let go of.
struct RunningCalls {
  Mutex mutex;
  ConditionVariable changed;
  bool closing RELMAP_GUARDED_BY(mutex) = false;
  std::set<std::shared_ptr<ForwardedCall::Reactor>> reactors RELMAP_GUARDED_BY(mutex);
  // Set when a call could not reach the daemon: it may have been started again, at another address.
  std::atomic<bool> unreachable{false};
  std::function<void(const std::string& token)> refused;  // set before the first call
};

// gRPC's end of a call. It lives until gRPC lets go of it, and holds the call open while nothing is being read, since a
// read begins on another thread than gRPC's.
class ForwardedCall::Reactor final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  Reactor(std::shared_ptr<Shared> shared, std::shared_ptr<RunningCalls> running, std::string token)
      : shared_(std::move(shared)), running_(std::move(running)), token_(std::move(token)) {}

  static void start(const std::shared_ptr<Reactor>& reactor, grpc::GenericStub& stub, const std::string& method,
                    std::string_view message) {
    reactor->request_ = buffer_of(message);
    {
      const MutexLock lock(reactor->running_->mutex);
      reactor->running_->reactors.insert(reactor);
      if (reactor->running_->closing) reactor->context.TryCancel();
    }
    stub.PrepareBidiStreamingCall(&reactor->context, method, grpc::StubOptions(), reactor.get());
    reactor->StartWriteLast(&reactor->request_, grpc::WriteOptions());
    reactor->AddHold();
    reactor->StartCall();
  }

  void read() {
    {
      const MutexLock lock(mutex_);
      if (!held_) return;
      reading_ = true;
    }
    StartRead(&reply_);
  }

  // Nobody waits for anything of this call any more.
  void abandon() {
    bool release = false;
    {
      const MutexLock lock(mutex_);
      abandoned_ = true;
      release = held_ && !reading_;
      if (release) held_ = false;
    }
    context.TryCancel();
    if (release) RemoveHold();
  }

  void OnReadDone(bool ok) override {
    bool release = false;
    {
      const MutexLock lock(mutex_);
      reading_ = false;
      release = held_ && (!ok || abandoned_);
      if (release) held_ = false;
    }
    std::optional<std::string> message;
    if (ok) message = text_of(reply_);
    reply_.Clear();
    asio::post(shared_->executor, [shared = shared_, message = std::move(message)]() mutable {
      shared->read = true;
      shared->message = std::move(message);
      shared->wake.cancel();
    });
    if (release) RemoveHold();
  }

  void OnWriteDone(bool) override { request_.Clear(); }

  void OnDone(const grpc::Status& status) override {
    if (status.error_code() == grpc::StatusCode::UNAVAILABLE) running_->unreachable = true;
    const bool refused = status.error_code() == grpc::StatusCode::UNAUTHENTICATED && !token_.empty();
    if (refused && running_->refused) running_->refused(token_);
    asio::post(shared_->executor, [shared = shared_, status] {
      shared->end = {static_cast<int>(status.error_code()), status.error_message(), status.error_details()};
      shared->ended = status;
      shared->wake.cancel();
    });
    shared_.reset();  // before the link is told, after which the executor may go
    const std::shared_ptr<RunningCalls> running = running_;
    const MutexLock lock(running->mutex);
    const auto own = std::find_if(running->reactors.begin(), running->reactors.end(),
                                  [&](const auto& one) { return one.get() == this; });
    running->reactors.erase(own);  // perhaps the last that holds this
    running->changed.notify_all();
  }

  grpc::ClientContext context;

 private:
  std::shared_ptr<Shared> shared_;
  const std::shared_ptr<RunningCalls> running_;
  const std::string token_;
  grpc::ByteBuffer request_, reply_;
  Mutex mutex_;
  bool held_ RELMAP_GUARDED_BY(mutex_) = true, reading_ RELMAP_GUARDED_BY(mutex_) = false,
             abandoned_ RELMAP_GUARDED_BY(mutex_) = false;
};

ForwardedCall::ForwardedCall(std::shared_ptr<Shared> shared, std::shared_ptr<Reactor> reactor)
    : shared_(std::move(shared)), reactor_(std::move(reactor)) {}

ForwardedCall::~ForwardedCall() {
  if (reactor_) reactor_->abandon();
}

boost::asio::awaitable<std::optional<std::string>> ForwardedCall::next(std::function<bool()> gone) {
  constexpr std::chrono::seconds kLook{1};
  const std::shared_ptr<Shared> shared = shared_;
  shared->read = false;
  shared->message.reset();
  if (!shared->ended) reactor_->read();
  boost::system::error_code ignored;
  for (bool asks = true; !shared->ended || shared->read;) {
    if (shared->read) {
      if (shared->message) co_return std::move(shared->message);
      shared->read = false;  // no further message: the end follows
      continue;
    }
    shared->wake.expires_after(kLook);
    co_await shared->wake.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
    if (asks && gone && !shared->read && !shared->ended && gone()) {
      reactor_->context.TryCancel();
      asks = false;
    }
  }
  co_return std::nullopt;
}

const CallEnd& ForwardedCall::end() const { return shared_->end; }

Status ForwardedCall::status() const {
  return shared_->ended ? client::status_of(*shared_->ended) : Status(Reason::INTERNAL, "the call has not ended");
}

struct DaemonLink::Impl {
  Impl(std::string s, std::string a, bool by_socket)
      : server(std::move(s)), authorities(std::move(a)), socket(by_socket) {}

  void connect(const client::ServerAddress& found) RELMAP_REQUIRES(mutex) {
    where = found;
    stub = std::make_shared<grpc::GenericStub>(
        client::open_channel_for_tokens(found, authorities, client::usual_channel_arguments()));
  }

  Result<client::ServerAddress> resolve() const {
    auto found = client::resolve_server(server);
    if (found.ok() && found->is_socket() != socket)
      return Status(Reason::NEEDS_RESTART,
                    "the daemon of " + server + " now answers " +
                        (socket ? "by TCP only, and had a Unix socket" : "by a Unix socket, and did not") +
                        " when the console started, which decides whom it lets in: start the console again");
    return found;
  }

  // A daemon that was started again may answer elsewhere.
  Result<std::shared_ptr<grpc::GenericStub>> now() {
    const MutexLock lock(mutex);
    if (!where.boot_id.empty() && running->unreachable.exchange(false)) {
      const auto found = resolve();
      if (found.reason() == Reason::NEEDS_RESTART) {
        running->unreachable = true;
        return found.status();
      }
      if (found.ok() && (found->address != where.address || found->boot_id != where.boot_id)) connect(*found);
    }
    return stub;
  }

  const std::string server, authorities;
  const bool socket;
  Mutex mutex;
  client::ServerAddress where RELMAP_GUARDED_BY(mutex);
  std::shared_ptr<grpc::GenericStub> stub RELMAP_GUARDED_BY(mutex);
  const std::shared_ptr<RunningCalls> running = std::make_shared<RunningCalls>();
};

DaemonLink::DaemonLink(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::unique_ptr<DaemonLink>> DaemonLink::open(const std::string& server, const std::string& authorities) {
  const auto where = client::resolve_server(server);
  if (!where.ok()) return where.status();
  auto impl = std::make_unique<Impl>(server, authorities, where->is_socket());
  {
    const MutexLock lock(impl->mutex);
    impl->connect(*where);
  }
  return std::unique_ptr<DaemonLink>(new DaemonLink(std::move(impl)));
}

DaemonLink::~DaemonLink() {
  RunningCalls& running = *impl_->running;
  std::set<std::shared_ptr<ForwardedCall::Reactor>> all;
  {
    const MutexLock lock(running.mutex);
    running.closing = true;
    all = running.reactors;
  }
  for (const auto& reactor : all) reactor->abandon();
  all.clear();
  MutexLock lock(running.mutex);
  while (!running.reactors.empty()) running.changed.wait(running.mutex);
}

bool DaemonLink::is_socket() const { return impl_->socket; }
bool DaemonLink::uses_tls() const { return !is_socket() && !impl_->authorities.empty(); }
Result<client::ServerAddress> DaemonLink::where() const { return impl_->resolve(); }

void DaemonLink::on_refusal(std::function<void(const std::string& token)> told) {
  impl_->running->refused = std::move(told);
}

boost::asio::awaitable<Result<ForwardedCall>> DaemonLink::call(std::string method, std::string message,
                                                               CallOptions options) {
  const Result<std::shared_ptr<grpc::GenericStub>> stub = impl_->now();
  if (!stub.ok()) co_return stub.status();
  auto shared = std::make_shared<ForwardedCall::Shared>(co_await asio::this_coro::executor);
  auto reactor = std::make_shared<ForwardedCall::Reactor>(shared, impl_->running, options.token);
  if (!options.token.empty()) options.metadata.emplace_back("authorization", "Bearer " + options.token);
  for (const auto& [name, value] : options.metadata)
    if (is_header_value(value)) reactor->context.AddMetadata(name, value);
  if (options.timeout) {
    // gRPC's clock cannot hold all times that a caller may name.
    constexpr std::chrono::hours kLongest{24 * 365};
    reactor->context.set_deadline(std::chrono::system_clock::now() +
                                  std::min<std::chrono::microseconds>(*options.timeout, kLongest));
  }
  ForwardedCall::Reactor::start(reactor, **stub, method, message);
  co_return ForwardedCall(std::move(shared), std::move(reactor));
}

boost::asio::awaitable<Result<std::string>> DaemonLink::ask(std::string method, std::string message,
                                                            CallOptions options) {
  Result<ForwardedCall> call = co_await this->call(std::move(method), std::move(message), std::move(options));
  if (!call.ok()) co_return call.status();
  std::optional<std::string> reply = co_await call->next();
  if (reply) {
    const std::optional<std::string> more = co_await call->next();
    if (more) co_return Result<std::string>(Reason::INTERNAL, "the daemon answered twice");
  }
  const Status status = call->status();
  if (!status.ok()) co_return status;
  if (!reply) co_return Result<std::string>(Reason::INTERNAL, "the daemon answered nothing");
  co_return std::move(*reply);
}

}  // namespace relmap::console
