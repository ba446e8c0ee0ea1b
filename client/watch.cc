#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <thread>
#include <utility>

#include "client/client_impl.h"
#include "client/event_json.h"
#include "client/replies.h"

namespace relmap::client {

namespace {

using Steady = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kSlice{50};  // between two questions whether the watch is to end
constexpr std::chrono::milliseconds kFirstPause{100}, kLongestPause{5000};  // before a connection is made again
constexpr std::chrono::milliseconds kFirstConnectTimeout{1000};

// Failures that last, whatever daemon answers next.
bool is_final(Reason reason) {
  constexpr std::array kFinal{Reason::UNAUTHENTICATED, Reason::NOT_ALLOWED,    Reason::INVALID_ARGUMENT,
                              Reason::UNIMPLEMENTED,   Reason::CORRUPT,        Reason::NO_SUCH_FILE,
                              Reason::BAD_CONFIG,      Reason::NO_SUCH_SESSION};
  return std::find(kFinal.begin(), kFinal.end(), reason) != kFinal.end();
}

v1::WatchMapRequest watch_request(const WatchOptions& options) {
  v1::WatchMapRequest request;
  request.mutable_sessions()->Add(options.sessions.begin(), options.sessions.end());
  request.set_resume_token(options.resume_token);
  request.set_from(options.from == WatchOptions::From::kOldest ? v1::WATCH_FROM_OLDEST : v1::WATCH_FROM_NOW);
  request.set_no_frames(options.no_frames);
  return request;
}

// One call of WatchMap, whose messages are waited for in slices. Ends the call with itself.
class WatchCall {
 public:
  WatchCall(v1::Map::Stub& map, grpc::ClientContext& context, const v1::WatchMapRequest& request)
      : context_(context), reader_(map.AsyncWatchMap(&context, request, &queue_, this)) {}
  ~WatchCall() {
    context_.TryCancel();
    while (under_way_) take(Steady::time_point::max());
    if (!ended_) end();
    queue_.Shutdown();
    void* tag = nullptr;
    bool ok = false;
    while (queue_.Next(&tag, &ok)) {
    }
  }
  WatchCall(const WatchCall&) = delete;
  WatchCall& operator=(const WatchCall&) = delete;

  enum class Came : std::uint8_t { kNothing, kMessage, kEnd };
  // Waits until something comes, but not beyond `until`.
  Came wait(Steady::time_point until, v1::MapEvent& message) {
    for (;;) {
      if (!under_way_) {
        reader_->Read(&message, this);
        under_way_ = true;
      }
      const auto took = take(until);
      if (!took) return Came::kNothing;
      if (!*took) return Came::kEnd;
      if (std::exchange(begun_, true)) return Came::kMessage;
    }
  }
  // After kEnd: why.
  grpc::Status end() {
    grpc::Status status;
    reader_->Finish(&status, this);
    under_way_ = true;
    take(Steady::time_point::max());
    ended_ = true;
    return status;
  }

 private:
  // Whether what is under way succeeded; nullopt if that is not known by then.
  std::optional<bool> take(Steady::time_point until) {
    void* tag = nullptr;
    bool ok = false;
    const auto left = until == Steady::time_point::max() ? std::chrono::hours(24) : until - Steady::now();
    const auto came = queue_.AsyncNext(
        &tag, &ok, std::chrono::system_clock::now() + std::chrono::duration_cast<std::chrono::milliseconds>(left));
    if (came != grpc::CompletionQueue::GOT_EVENT) return {};
    under_way_ = false;
    return ok;
  }

  grpc::ClientContext& context_;
  grpc::CompletionQueue queue_;
  bool under_way_ = true;  // at first, that the call begins
  bool begun_ = false, ended_ = false;
  const std::unique_ptr<grpc::ClientAsyncReader<v1::MapEvent>> reader_;
};

// A watch through all its connections.
class Watch {
 public:
  Watch(const WatchOptions& options, const Client::WatchSink& sink)
      : options_(options), sink_(sink), request_(watch_request(options)) {}

  const v1::WatchMapRequest& request() const { return request_; }
  bool stopped() const { return options_.stopped && options_.stopped(); }
  // Whether the sink has ended it, and how.
  const std::optional<Status>& end() const { return end_; }

  // Takes messages until the connection ends; returns why. OK: the watch is to end.
  template <typename Impl>
  Status take_from(const Impl& impl) {
    grpc::ClientContext context;
    impl.name(context);
    v1::MapEvent message;
    WatchCall call(*impl.map, context, request_);
    for (auto heard = Steady::now();;) {
      if (stopped()) return {};
      switch (call.wait(Steady::now() + kSlice, message)) {
        case WatchCall::Came::kEnd:
          return status_of(call.end());
        case WatchCall::Came::kNothing:
          if (Steady::now() - heard < options_.dead_after) continue;
          return {Reason::UNREACHABLE, "nothing came for " + std::to_string(options_.dead_after.count() / 1000) +
                                           " s: the connection is dead"};
        case WatchCall::Came::kMessage:
          heard = Steady::now();
          if (Status taken = take(impl, message); !taken.ok() || end_) return taken;
      }
    }
  }
  // Tells that there is no daemon, once for each reason.
  void disconnected(const Status& why) {
    connected_ = false;
    if (told_ == why.reason()) return;
    told_ = why.reason();
    tell(WatchDisconnected{why});
  }
  bool connected() const { return connected_; }

 private:
  template <typename Impl>
  Status take(const Impl& impl, const v1::MapEvent& message) {
    if (!std::exchange(connected_, true)) tell(WatchConnected{});
    told_.reset();
    if (end_) return *end_;
    const auto event = read_event(message);
    if (!event.ok()) return event.status();
    if (impl.options.on_reply) impl.options.on_reply(event_json(message));
    if (*event) tell(std::move(**event));
    if (!message.resume_token().empty()) request_.set_resume_token(message.resume_token());
    return end_.value_or(Status());
  }
  template <typename What>
  void tell(What what) {
    WatchEvent event;
    if constexpr (std::is_same_v<What, WatchEvent>) {
      event = std::move(what);
    } else {
      event.what = std::move(what);
      event.resume_token = request_.resume_token();
    }
    if (Status taken = sink_(event); !taken.ok()) end_ = std::move(taken);
  }

  const WatchOptions& options_;
  const Client::WatchSink& sink_;
  v1::WatchMapRequest request_;
  std::optional<Status> end_;
  bool connected_ = false;
  std::optional<Reason> told_;  // why there is no connection
};

}  // namespace

Status Client::watch(const WatchOptions& options, const WatchSink& sink) {
  Watch watch(options, sink);
  std::unique_ptr<Client> again;
  std::chrono::milliseconds pause = kFirstPause, connect_timeout = kFirstConnectTimeout;
  Status why = watch.take_from(*impl_);
  for (;;) {
    if (watch.end()) return *watch.end();
    if (watch.stopped()) return {};
    if (!options.reconnect || is_final(why.reason())) return why;
    if (watch.connected()) {
      pause = kFirstPause;
      connect_timeout = kFirstConnectTimeout;
    }
    watch.disconnected(why);
    if (watch.end()) return *watch.end();
    for (const auto until = Steady::now() + pause; Steady::now() < until && !watch.stopped();)
      std::this_thread::sleep_for(kSlice);
    if (watch.stopped()) return {};
    pause = std::min(2 * pause, kLongestPause);
    ClientOptions fresh = impl_->options;
    fresh.connect_timeout = std::min(fresh.connect_timeout, connect_timeout);
    connect_timeout *= 2;
    auto connected = connect(impl_->server, fresh);
    if (!connected.ok()) {
      why = connected.status();
      continue;
    }
    again = std::move(*connected);
    why = watch.take_from(*again->impl_);
  }
}

}  // namespace relmap::client
