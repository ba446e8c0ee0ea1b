#include "server/ingest/lcm_ingest.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <thread>
#include <utility>

#include "proto/base/clock.h"
#include "proto/base/mutex.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_link.h"
#include "proto/wire/receive_buffer.h"

namespace relmap::ingest {

namespace {

constexpr std::chrono::seconds kStatusInterval{1};
constexpr std::chrono::milliseconds kMapInterval{100};  // while acknowledgements are sent

template <typename Message, typename Take>
LcmLink::Handler handler(intake::IngestServer& server, Result<Message> (*decode)(ByteSpan), Take take) {
  return [&server, decode, take](ByteSpan bytes) {
    Result<Message> message = decode(bytes);
    if (message.ok())
      take(std::move(*message));
    else
      server.count_foreign(message.reason());
  };
}

}  // namespace

struct LcmIngest::Impl {
  Impl(intake::IngestServer& s, StatusSource source, std::unique_ptr<LcmLink> l)
      : server(s), status(std::move(source)), link(std::move(l)) {}

  // Called by the server's thread. Robots believe no acknowledgement before they know which map it is about.
  void acknowledge(const Acknowledgement& ack) {
    const auto now = std::chrono::steady_clock::now();
    if (now - map_said >= kMapInterval) {
      map_said = now;
      say_map();
    }
    link->publish(kAckChannel, encode_lcm(ack));
  }

  void say_map() { link->publish(kMapChannel, encode_lcm(server.identity())); }

  void say_status() {
    DaemonStatus news = status();
    news.boot = server.identity().boot;
    news.time_us = now_us();
    news.uptime_us =
        std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - started).count();
    link->publish(kStatusChannel, encode_lcm(news));
  }

  void run() {
    MutexLock lock(mutex);
    while (!stopping) {
      lock.unlock();
      say_map();
      say_status();
      lock.lock();
      stopped.wait_for(mutex, kStatusInterval, [this]() RELMAP_REQUIRES(mutex) { return stopping; });
    }
  }

  intake::IngestServer& server;
  const StatusSource status;
  const std::chrono::steady_clock::time_point started = std::chrono::steady_clock::now();
  const std::unique_ptr<LcmLink> link;
  std::chrono::steady_clock::time_point map_said{};  // used by the server's thread only
  std::unique_ptr<intake::IngestServer::Subscription> said;
  Mutex mutex;
  ConditionVariable stopped;
  bool stopping RELMAP_GUARDED_BY(mutex) = false;
  std::thread status_thread;
};

LcmIngest::LcmIngest(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::unique_ptr<LcmIngest>> LcmIngest::start(const std::string& url, intake::IngestServer& server,
                                                    StatusSource status, std::size_t queue_bytes) {
  Result<std::unique_ptr<LcmLink>> link = LcmLink::open(
      url,
      {{kKeyframeChannel,
        handler(server, decode_lcm_part, [&](KeyframePart part) { server.take_part(std::move(part)); })},
       {kGapChannel, handler(server, decode_lcm_gap, [&](const Gap& gap) { (void)server.take_gap(gap); })},
       {kEndChannel, handler(server, decode_lcm_end, [&](const SessionEnd& end) { (void)server.take_end(end); })}},
      queue_bytes);
  if (!link.ok()) return link.status();
  auto impl = std::make_unique<Impl>(server, std::move(status), std::move(*link));
  LcmLink* const out = impl->link.get();
  impl->said = server.subscribe({[said = impl.get()](const Acknowledgement& ack) { said->acknowledge(ack); },
                                 [out](const PoseNews& news) { out->publish(kPoseChannel, encode_lcm(news)); },
                                 {}});
  if (impl->status) impl->status_thread = std::thread([running = impl.get()] { running->run(); });
  spdlog::info("LCM: listening on {}", url);
  if (const auto complete = complete_lcm_url(url); complete.ok())
    if (const std::string advice = receive_buffer_advice(*complete); !advice.empty()) spdlog::warn("LCM: {}", advice);
  return std::unique_ptr<LcmIngest>(new LcmIngest(std::move(impl)));
}

LcmIngest::~LcmIngest() { stop(); }

bool LcmIngest::at_end() const { return impl_->link->at_end(); }

void LcmIngest::stop() {
  impl_->link->stop();
  impl_->said.reset();
  {
    const MutexLock lock(impl_->mutex);
    impl_->stopping = true;
    impl_->stopped.notify_all();
  }
  if (impl_->status_thread.joinable()) impl_->status_thread.join();
}

}  // namespace relmap::ingest
