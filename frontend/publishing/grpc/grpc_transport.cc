#include "frontend/publishing/grpc/grpc_transport.h"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <cassert>
#include <deque>
#include <optional>
#include <thread>
#include <utility>

#include "client/channel.h"
#include "client/rpc_error.h"
#include "client/server_address.h"
#include "frontend/publishing/grpc/stream_messages.h"
#include "proto/base/hex.h"
#include "proto/base/mutex.h"
#include "relmap/v1/ingest.grpc.pb.h"

namespace relmap::publishing {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kFirstPause{100}, kMaxPause{2000};

grpc::ChannelArguments channel_arguments() {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // A new channel must not inherit the back-off of an old one to the same address; the pauses are made here.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return arguments;
}

bool same(const v1::IngestRequest& a, const v1::IngestRequest& b) {
  if (a.content_case() != b.content_case()) return false;
  switch (a.content_case()) {
    case v1::IngestRequest::kKeyframe:
      return a.keyframe().sequence() == b.keyframe().sequence() && a.keyframe().crc32c() == b.keyframe().crc32c() &&
             a.keyframe().session_uuid() == b.keyframe().session_uuid();
    case v1::IngestRequest::kGap:
      return a.gap().first() == b.gap().first() && a.gap().last() == b.gap().last() &&
             a.gap().session_uuid() == b.gap().session_uuid();
    default:
      return a.end().next_sequence() == b.end().next_sequence() && a.end().session_uuid() == b.end().session_uuid();
  }
}

}  // namespace

struct GrpcTransport::Impl {
  Impl(std::string given_server, std::string given_robot, GrpcTransportOptions given_options)
      : server(std::move(given_server)), robot(std::move(given_robot)), options(given_options) {}

  // One call. The members below `transport` are guarded by the transport's mutex.
  struct Stream final : grpc::ClientBidiReactor<v1::IngestRequest, v1::IngestReply> {
    Stream(Impl& owner, const client::ServerAddress& address, const std::shared_ptr<grpc::Channel>& channel)
        : where(address), stub(v1::Ingest::NewStub(channel)), transport(owner) {}

    void start() {
      stub->async()->Stream(&context, this);
      AddHold();  // until the transport's thread has stopped writing
      StartRead(&reply);
      StartCall();
    }
    void write(v1::IngestRequest next) {
      request = std::move(next);
      StartWrite(&request);
    }

    void OnReadDone(bool ok) override {
      if (ok) transport.hear(*this);
      if (ok) return StartRead(&reply);
      const MutexLock lock(transport.mutex);
      broken = true;
      transport.changed.notify_all();
    }
    void OnWriteDone(bool ok) override {
      const MutexLock lock(transport.mutex);
      writing = !ok;  // after a failure reading ends, too
      transport.changed.notify_all();
    }
    void OnDone(const grpc::Status& status) override {
      const MutexLock lock(transport.mutex);
      outcome = status;
      transport.changed.notify_all();
    }

    const client::ServerAddress where;
    const std::unique_ptr<v1::Ingest::Stub> stub;
    grpc::ClientContext context;
    v1::IngestRequest request;
    v1::IngestReply reply;

    Impl& transport;
    bool writing = true;
    bool broken = false;         // the daemon's side has ended
    std::optional<BootId> boot;  // the daemon's, once it has sent its welcome
    bool acknowledged = false;   // the daemon has acknowledged something
    Status fault;                // why the stream must be closed
    std::optional<Clock::time_point> unanswered_since;
    std::optional<grpc::Status> outcome;
  };

  void run() {
    milliseconds pause = kFirstPause;
    MutexLock lock(mutex);
    while (!stopping) {
      bool acknowledged = false;
      Status why = talk(acknowledged);
      if (stopping) break;
      trouble = std::move(why);
      if (acknowledged) pause = kFirstPause;
      changed.wait_for(mutex, pause, [&]() RELMAP_REQUIRES(mutex) { return stopping; });
      pause = std::min(2 * pause, kMaxPause);
    }
  }

  // Runs one stream until it ends, and returns why it did.
  Status talk(bool& acknowledged) RELMAP_REQUIRES(mutex) {
    mutex.unlock();
    const auto where = client::resolve_server(server);
    if (!where.ok()) {
      mutex.lock();
      return where.status();
    }

    const auto channel = client::open_channel(*where, options.credentials, channel_arguments());
    if (!channel.ok()) {
      mutex.lock();
      return channel.status();
    }

    Stream stream(*this, *where, *channel);
    stream.unanswered_since = Clock::now();
    stream.start();
    stream.write(hello_request(robot));
    mutex.lock();

    while (!stopping && !stream.broken && stream.fault.ok()) {
      if (stream.boot && !stream.writing && !waiting.empty()) {
        write_next(stream);
        continue;
      }
      const auto now = Clock::now();
      const auto deadline = stream.unanswered_since.value_or(now) + options.silence;
      if (now >= deadline)
        stream.fault = {Reason::UNREACHABLE, "the daemon does not answer"};
      else
        changed.wait_until(mutex, deadline);
    }
    const bool broken = stream.broken;
    mutex.unlock();
    if (!broken) stream.context.TryCancel();
    stream.RemoveHold();
    mutex.lock();

    changed.wait(mutex, [&]() RELMAP_REQUIRES(mutex) { return stream.outcome.has_value(); });
    mutex.unlock();
    say_broken();
    mutex.lock();

    // The next daemon may serve another map. PublisherCore sends again what waits here once that daemon has said which.
    waiting.clear();
    waiting_bytes = 0;
    acknowledged = stream.acknowledged;
    Status why = stream.fault.ok() ? client::status_of(*stream.outcome) : stream.fault;
    if (why.ok()) why = {Reason::UNREACHABLE, "the daemon has ended the stream"};
    welcomed = welcomed || stream.boot;
    const bool never_connected = why.reason() == Reason::UNREACHABLE && !welcomed;
    return {why.reason(),
            where->address + ": " + why.message() +
                (never_connected ? client::other_causes(*where, options.credentials, why.message()) : "")};
  }

  void write_next(Stream& stream) RELMAP_REQUIRES(mutex) {
    v1::IngestRequest next = std::move(waiting.front());
    waiting.pop_front();
    waiting_bytes -= next.ByteSizeLong();
    stream.writing = true;
    if (!stream.unanswered_since) stream.unanswered_since = Clock::now();
    const MutexUnlock unlocked(mutex);
    stream.write(std::move(next));
  }

  // Called by a thread of gRPC.
  void hear(Stream& stream) {
    const v1::IngestReply& reply = stream.reply;
    {
      MutexLock lock(mutex);
      stream.unanswered_since = stream.writing ? std::optional(Clock::now()) : std::nullopt;
      if (!stream.boot) return welcome(stream);
      if (reply.has_acknowledgement()) stream.acknowledged = true;
    }
    const MutexLock lock(listener_mutex);
    if (reply.has_acknowledgement()) {
      const auto ack = read_acknowledgement(reply.acknowledgement());
      if (ack.ok() && listener.acknowledged) listener.acknowledged(*ack);
    } else {
      const auto news = read_news(reply, *stream.boot);
      if (news.ok() && listener.news) listener.news(*news);
    }
  }

  void say_broken() {
    const MutexLock lock(listener_mutex);
    introduced.reset();
    if (listener.broken) listener.broken();
  }

  void welcome(Stream& stream) RELMAP_REQUIRES(mutex) {
    const auto daemon = stream.reply.has_welcome()
                            ? read_welcome(stream.reply.welcome())
                            : Result<DaemonIdentity>(Reason::CORRUPT, "the daemon does not say welcome");
    if (!daemon.ok()) {
      stream.fault = daemon.status();
    } else if (!stream.where.boot_id.empty() && hex(daemon->boot) != stream.where.boot_id) {
      stream.fault = {Reason::UNREACHABLE, "the daemon that served " + server + " is gone, another answers"};
    } else {
      {
        const MutexUnlock unlocked(mutex);
        introduce(*daemon);  // before anything is written
      }

      stream.boot = daemon->boot;
      trouble = {};
    }
    changed.notify_all();
  }

  void introduce(const DaemonIdentity& daemon) {
    const MutexLock lock(listener_mutex);
    introduced = daemon;
    if (listener.introduced) listener.introduced(daemon);
  }

  void send(v1::IngestRequest request) {
    const MutexLock lock(mutex);
    const std::size_t bytes = request.ByteSizeLong();
    const auto is_same = [&](const v1::IngestRequest& other) { return same(request, other); };
    if (waiting_bytes + bytes > options.waiting_bytes || std::any_of(waiting.begin(), waiting.end(), is_same)) return;
    waiting.push_back(std::move(request));
    waiting_bytes += bytes;
    changed.notify_all();
  }

  const std::string server, robot;
  const GrpcTransportOptions options;

  Mutex listener_mutex;
  Listener listener RELMAP_GUARDED_BY(listener_mutex);
  std::optional<DaemonIdentity> introduced
      RELMAP_GUARDED_BY(listener_mutex);  // of the open stream; repeated to a listener that registers later

  mutable Mutex mutex;
  ConditionVariable changed;
  std::deque<v1::IngestRequest> waiting RELMAP_GUARDED_BY(mutex);
  std::size_t waiting_bytes RELMAP_GUARDED_BY(mutex) = 0;
  Status trouble RELMAP_GUARDED_BY(mutex);
  bool welcomed RELMAP_GUARDED_BY(mutex) = false;  // by some daemon, at some time
  bool stopping RELMAP_GUARDED_BY(mutex) = false;
  std::thread thread;
};

Result<std::unique_ptr<GrpcTransport>> GrpcTransport::open(const std::string& server, const std::string& robot,
                                                           GrpcTransportOptions options) {
  const auto where = client::resolve_server(server);
  if (where.reason() == Reason::INVALID_ARGUMENT) return where.status();
  if (where.ok())
    if (const auto usable = client::open_channel(*where, options.credentials, {}); !usable.ok()) return usable.status();
  auto impl = std::make_unique<Impl>(server, robot, std::move(options));
  impl->thread = std::thread([running = impl.get()] { running->run(); });
  return std::unique_ptr<GrpcTransport>(new GrpcTransport(std::move(impl)));
}

GrpcTransport::GrpcTransport(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

GrpcTransport::~GrpcTransport() { stop(); }

PublishTransport::PartBytes GrpcTransport::part_bytes() const {
  return {kMaxKeyframeBytes, kMaxKeyframeBytes, kMaxKeyframeBytes};
}

Status GrpcTransport::trouble() const {
  const MutexLock lock(impl_->mutex);
  return impl_->trouble;
}

void GrpcTransport::send(const KeyframePart& part) {
  assert(part.parts == 1);
  impl_->send(keyframe_request(part));
}

void GrpcTransport::send(const Gap& gap) { impl_->send(gap_request(gap)); }

void GrpcTransport::send(const SessionEnd& end) { impl_->send(end_request(end)); }

void GrpcTransport::listen(Listener listener) {
  const MutexLock lock(impl_->listener_mutex);
  impl_->listener = std::move(listener);
  if (impl_->introduced && impl_->listener.introduced) impl_->listener.introduced(*impl_->introduced);
}

void GrpcTransport::stop() {
  {
    const MutexLock lock(impl_->mutex);
    impl_->stopping = true;
    impl_->changed.notify_all();
  }
  if (impl_->thread.joinable()) impl_->thread.join();
  listen({});
}

}  // namespace relmap::publishing
