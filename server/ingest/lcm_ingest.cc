#include "server/ingest/lcm_ingest.h"

#include <spdlog/spdlog.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <utility>

#include "proto/base/clock.h"
#include "proto/base/mutex.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_link.h"
#include "proto/wire/receive_buffer.h"
#include "server/ingest/sealed_robots.h"

namespace relmap::ingest {

namespace {

constexpr std::chrono::seconds kStatusInterval{1};
constexpr std::chrono::milliseconds kMapInterval{100};  // while acknowledgements are sent

using Who = LcmAuthentication::Who;

SealedRobots::Time now() { return std::chrono::steady_clock::now(); }
std::int64_t utc_s() { return now_us() / 1'000'000; }

}  // namespace

struct LcmIngest::Impl {
  Impl(const LcmOptions& options, intake::IngestServer& s, StatusSource source)
      : server(s),
        status(std::move(source)),
        who(options.authentication.who),
        sealed(s.identity().boot, options.authentication.secret, started) {}

  // The handler of a channel: opens the datagrams, and gives their messages to `take` with who sent them.
  template <typename Message, typename Take>
  LcmLink::Handlers::value_type on(const char* channel, Result<Message> (*decode)(ByteSpan), Take take) {
    return {channel, [this, channel, decode, take](ByteSpan datagram) {
              intake::Sender sender;
              Result<Message> message = open(channel, datagram, decode, sender);
              if (message.ok())
                take(std::move(*message), std::move(sender));
              else
                server.count_foreign(message.reason());
            }};
  }

  // Messages end by themselves, so one that is not sealed is told from one that is: nothing follows it.
  template <typename Message>
  Result<Message> open(const char* channel, ByteSpan datagram, Result<Message> (*decode)(ByteSpan),
                       intake::Sender& sender) {
    if (who != Who::kAll) {
      Result<Message> message = decode(datagram);
      sender.anyone = true;
      if (message.ok()) return message;
      if (who == Who::kNobody) {
        const auto split = access::split_sealed(datagram);
        return split && message.reason() == Reason::CORRUPT ? decode(split->message) : message;
      }
      if (message.reason() != Reason::CORRUPT) return message;
    }
    MutexLock lock(mutex);
    const auto opened = sealed.open(channel, datagram, now(), utc_s());
    if (!opened.ok()) {
      const std::string complaint = sealed.take_complaint();
      lock.unlock();
      log_complaint(complaint);
      return opened.status();
    }
    Result<Message> message = decode(opened->message);
    if (message.ok()) sealed.sends(*opened, message->session);
    sender = {opened->robot, false};
    return message;
  }

  static void log_complaint(const std::string& complaint) {
    if (!complaint.empty()) spdlog::warn("LCM: {}, and what it seals is not taken", complaint);
  }

  void take_hello(ByteSpan datagram) {
    if (who == Who::kNobody) return;
    Bytes welcome;
    Status refused;
    std::string complaint;
    SessionUuid session;
    intake::Sender sender;
    {
      const MutexLock lock(mutex);
      const auto opened = sealed.open_hello(datagram, utc_s());
      complaint = sealed.take_complaint();
      const auto hello = opened.ok() ? decode_lcm_hello(opened->message) : opened.status();
      if (hello.ok()) welcome = sealed.welcome(*opened, encode_lcm(server.identity()), now());
      refused = hello.status();
      if (hello.ok()) {
        session = hello->session;
        sender.robot = opened->robot;
      }
    }
    log_complaint(complaint);
    if (!refused.ok()) return server.count_foreign(refused.reason());
    if (welcome.empty()) return;
    // From now on its uuid is known to everyone on the network.
    server.claim(session, sender);
    if (LcmLink* const out = opened_link) out->publish(kMapChannel, welcome);
  }

  // Publishes what concerns a session: sealed for those who have sealed what they sent of it, and as it is where others
  // may send it, since one that has sealed something of it need not be its robot.
  void tell(const SessionUuid& session, const std::string& robot, const char* channel, const Bytes& message) {
    std::vector<Bytes> for_robots;
    if (who != Who::kNobody) {
      const MutexLock lock(mutex);
      for_robots = sealed.seal(session, robot, channel, message, now());
    }
    for (const Bytes& one : for_robots) link->publish(channel, one);
    if (who != Who::kAll) link->publish(channel, message);
  }

  // Called by the server's thread. Robots believe no acknowledgement before they know which map it is about.
  void acknowledge(const Acknowledgement& ack, const std::string& robot) {
    const auto time = now();
    if (time - map_said >= kMapInterval) {
      map_said = time;
      say_map();
    }
    tell(ack.session, robot, kAckChannel, encode_lcm(ack));
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
  const Who who;
  const SealedRobots::Time started = now();
  std::unique_ptr<LcmLink> link;
  std::atomic<LcmLink*> opened_link = nullptr;       // for the link's own thread, which runs before `link` is set
  std::chrono::steady_clock::time_point map_said{};  // used by the server's thread only
  std::unique_ptr<intake::IngestServer::Subscription> said;
  Mutex mutex;
  SealedRobots sealed RELMAP_GUARDED_BY(mutex);
  ConditionVariable stopped;
  bool stopping RELMAP_GUARDED_BY(mutex) = false;
  std::thread status_thread;
};

LcmIngest::LcmIngest(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::unique_ptr<LcmIngest>> LcmIngest::start(const LcmOptions& options, intake::IngestServer& server,
                                                    StatusSource status) {
  std::unique_ptr<LcmIngest> ingest(new LcmIngest(std::make_unique<Impl>(options, server, std::move(status))));
  Impl* const running = ingest->impl_.get();
  using intake::Sender;
  Result<std::unique_ptr<LcmLink>> link = LcmLink::open(
      options.url,
      {running->on(kKeyframeChannel, decode_lcm_part,
                   [&](KeyframePart part, Sender from) { server.take_part(std::move(part), std::move(from)); }),
       running->on(kGapChannel, decode_lcm_gap,
                   [&](const Gap& gap, const Sender& from) { server.take_gap(gap, from); }),
       running->on(kEndChannel, decode_lcm_end,
                   [&](const SessionEnd& end, const Sender& from) { server.take_end(end, from); }),
       {kHelloChannel, [running](ByteSpan datagram) { running->take_hello(datagram); }}},
      options.queue_bytes);
  if (!link.ok()) return link.status();
  running->link = std::move(*link);
  running->opened_link = running->link.get();
  running->said = server.subscribe({[running](const auto& ack, const auto& robot) { running->acknowledge(ack, robot); },
                                    [running](const auto& news, const auto& robot) {
                                      running->tell(news.session, robot, kPoseChannel, encode_lcm(news));
                                    },
                                    {}});
  if (running->status) running->status_thread = std::thread([running] { running->run(); });
  spdlog::info("LCM: listening on {}", options.url);
  if (const auto complete = complete_lcm_url(options.url); complete.ok())
    if (const std::string advice = receive_buffer_advice(*complete); !advice.empty()) spdlog::warn("LCM: {}", advice);
  return ingest;
}

LcmIngest::~LcmIngest() { stop(); }

void LcmIngest::use(const access::AccessList& list) {
  const MutexLock lock(impl_->mutex);
  impl_->sealed.use(list);
}

bool LcmIngest::at_end() const { return impl_->link->at_end(); }

void LcmIngest::stop() {
  if (impl_->link) impl_->link->stop();
  impl_->said.reset();
  {
    const MutexLock lock(impl_->mutex);
    impl_->stopping = true;
    impl_->stopped.notify_all();
  }
  if (impl_->status_thread.joinable()) impl_->status_thread.join();
}

}  // namespace relmap::ingest
