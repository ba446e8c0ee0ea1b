#include "frontend/publishing/lcm/lcm_transport.h"

#include <cstring>
#include <utility>

#include "frontend/publishing/publisher.h"
#include "proto/base/mutex.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_messages.h"

namespace relmap::publishing {

namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;
constexpr milliseconds kHelloSpacing{100}, kHelloInterval{500};
constexpr milliseconds kUnanswered{3000};

std::uint64_t random_run() {
  const access::SealKey random = access::random_key();
  std::uint64_t run = 0;
  std::memcpy(&run, random.data(), sizeof run);
  return run;
}

}  // namespace

LcmTransport::LcmTransport(Publish publish, bool local, LcmTransportOptions options)
    : publish_(std::move(publish)), local_(local) {
  const MutexLock lock(mutex_);
  if (options.key) daemon_.emplace(*options.key, random_run());
}

Result<std::unique_ptr<LcmTransport>> LcmTransport::open(const std::string& url, LcmTransportOptions options) {
  const Result<std::string> complete = complete_lcm_url(url);
  if (!complete.ok()) return complete.status();
  auto transport = std::make_unique<LcmTransport>(Publish(), stays_on_this_machine(*complete), options);
  LcmTransport* const to = transport.get();
  LcmLink::Handlers handlers;
  for (const char* channel : heard_channels())
    handlers.emplace_back(channel, [to, channel](ByteSpan datagram) { to->hear(channel, datagram); });
  Result<std::unique_ptr<LcmLink>> link = LcmLink::open(*complete, std::move(handlers));
  if (!link.ok()) return link.status();
  transport->link_ = std::move(*link);
  return transport;
}

std::vector<const char*> LcmTransport::heard_channels() { return {kAckChannel, kPoseChannel, kMapChannel}; }

// Whether a message of the daemon of this boot counts.
bool LcmTransport::counts(const BootId& boot, const Opened& opened) {
  return !opened.seal || daemon_->heard(boot, *opened.seal, Clock::now());
}

// The message of a datagram; with a key, only if a daemon has sealed it for this robot.
std::optional<LcmTransport::Opened> LcmTransport::open(std::string_view channel, ByteSpan datagram) {
  if (!daemon_) return Opened{datagram, {}};
  if (const auto opened = daemon_->open(channel, datagram)) return Opened{opened->message, opened->seal};
  if (channel != kMapChannel) return std::nullopt;
  // It proves nothing, but may be of a daemon that has just started.
  unsealed_heard_ |= decode_lcm_map(datagram).ok();
  hello_wanted_ |= daemon_->wants_hello(Clock::now());
  changed_.notify_all();
  return std::nullopt;
}

template <typename Message>
void LcmTransport::tell(std::function<void(const Message&)> Listener::*heard, const Message& message) {
  const MutexLock lock(listener_mutex_);
  if (listener_.*heard) (listener_.*heard)(message);
}

void LcmTransport::hear(std::string_view channel, ByteSpan datagram) {
  MutexLock lock(mutex_);
  const auto opened = open(channel, datagram);
  if (!opened) return;
  if (channel == kAckChannel) {
    const auto ack = decode_lcm_acknowledgement(opened->message);
    if (!ack.ok() || !counts(ack->boot, *opened)) return;
    acknowledged_ |= ack->session == session_;
    lock.unlock();
    tell(&Listener::acknowledged, *ack);
  } else if (channel == kPoseChannel) {
    const auto news = decode_lcm_pose(opened->message);
    if (!news.ok() || !counts(news->boot, *opened)) return;
    lock.unlock();
    tell(&Listener::news, *news);
  } else if (channel == kMapChannel) {
    const auto daemon = decode_lcm_map(opened->message);
    if (!daemon.ok() || !counts(daemon->boot, *opened)) return;
    unsealed_heard_ |= !daemon_;
    // Where the addressed daemon answers, another one that knows the key is nobody's business.
    if (daemon_ && !daemon_->welcome(*daemon, Clock::now()) && daemon_->ready(Clock::now())) return;
    lock.unlock();
    tell(&Listener::introduced, *daemon);
  }
}

Status LcmTransport::trouble() const {
  const MutexLock lock(mutex_);
  if (daemon_ && !daemon_->ready(Clock::now()) && unsealed_heard_)
    return {
        Reason::UNAUTHENTICATED,
        "there is a relmapd, which does not believe these credentials: they are revoked, expired or of another fleet, "
        "or it takes what nobody has sealed (lcm.authentication)"};
  if (!daemon_ && unsealed_heard_ && !acknowledged_ && sent_since_ && Clock::now() - *sent_since_ >= kUnanswered)
    return {Reason::UNAUTHENTICATED, "there is a relmapd, which may take only what is sealed: --credentials FILE"};
  return {};
}

PublishTransport::PartBytes LcmTransport::part_bytes() const {
  return {kMinPartBytes, local_ ? kMaxPartBytes : kNetworkPartBytes, kMaxPartBytes};
}

void LcmTransport::send(const KeyframePart& part) { transmit(kKeyframeChannel, encode_lcm(part)); }

void LcmTransport::send(const Gap& gap) { transmit(kGapChannel, encode_lcm(gap)); }

void LcmTransport::send(const SessionEnd& end) { transmit(kEndChannel, encode_lcm(end)); }

void LcmTransport::transmit(const char* channel, Bytes message) {
  {
    const MutexLock lock(mutex_);
    if (!sent_since_) sent_since_ = Clock::now();
    if (daemon_ && !daemon_->ready(Clock::now())) {
      hello_wanted_ = true;
      changed_.notify_all();
      return;
    }
    if (daemon_) daemon_->seal(channel, message);
  }
  put_out(channel, message);
}

void LcmTransport::put_out(const char* channel, const Bytes& datagram) {
  link_ ? link_->publish(channel, datagram) : publish_(channel, datagram);
}

// Says hello while the daemon is silent.
void LcmTransport::keep_in_touch() {
  MutexLock lock(mutex_);
  while (!stopping_) {
    const Time now = Clock::now();
    const bool wanted = daemon_->wants_hello(now) || hello_wanted_;
    const auto pause = hello_wanted_ ? kHelloSpacing : kHelloInterval;
    if (wanted && (!hello_said_ || now - *hello_said_ >= pause)) {
      hello_said_ = now;
      hello_wanted_ = false;
      Bytes hello = encode_lcm(Hello{session_});
      daemon_->seal_hello(hello);
      const MutexUnlock unlocked(mutex_);
      put_out(kHelloChannel, hello);
    }
    changed_.wait_for(mutex_, kHelloSpacing);
  }
}

void LcmTransport::sends_for(const SessionUuid& session, const Uuid& map) {
  const MutexLock lock(mutex_);
  session_ = session;
  if (daemon_ && !map.is_nil()) daemon_->pin(map);
}

void LcmTransport::listen(Listener listener) {
  {
    const MutexLock lock(listener_mutex_);
    listener_ = std::move(listener);
  }
  const MutexLock lock(mutex_);
  if (daemon_ && !stopping_ && !thread_.joinable()) thread_ = std::thread([this] { keep_in_touch(); });
}

void LcmTransport::stop() {
  if (link_) link_->stop();
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
  listen({});
}

Result<std::unique_ptr<Publisher>> Publisher::start(PublisherOptions options, SessionHeader header) {
  Result<std::unique_ptr<LcmTransport>> transport = LcmTransport::open(options.lcm_url);
  if (!transport.ok()) return transport.status();
  return start(std::move(options), std::move(header), std::move(*transport));
}

}  // namespace relmap::publishing
