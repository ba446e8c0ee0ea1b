#include "tests/support/lcm_attacker.h"

#include <chrono>
#include <iterator>
#include <string_view>
#include <utility>

#include "proto/base/clock.h"
#include "proto/base/crc32c.h"
#include "proto/keyframe/keyframe_samples.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_messages.h"

namespace relmap::testing {

namespace {

using Clock = std::chrono::steady_clock;

constexpr const char* kAllChannels[] = {kKeyframeChannel, kGapChannel,  kEndChannel, kHelloChannel,
                                        kAckChannel,      kPoseChannel, kMapChannel};
constexpr std::size_t kKept = 4000;
constexpr std::size_t kHelloEvery = 500;  // messages

}  // namespace

LcmAttacker::LcmAttacker(const std::string& url, std::vector<SessionUuid> sessions, std::uint64_t seed)
    : sessions_(std::move(sessions)), random_(seed), chance_(seed) {
  LcmLink::Handlers handlers;
  for (const char* channel : kAllChannels)
    handlers.emplace_back(channel, [this, channel](ByteSpan datagram) { record(channel, datagram); });
  link_ = LcmLink::open(url, std::move(handlers)).or_throw();
}

LcmAttacker::~LcmAttacker() { link_->stop(); }

void LcmAttacker::use(const access::RobotKey& own) {
  const std::lock_guard lock(mutex_);
  own_.emplace(own, 1);
}

std::size_t LcmAttacker::heard() const {
  const std::lock_guard lock(mutex_);
  return heard_.size();
}

void LcmAttacker::record(const char* channel, ByteSpan datagram) {
  const std::lock_guard lock(mutex_);
  if (own_ && std::string_view(channel) == kMapChannel) meet(datagram);
  if (datagram.size() < access::kSealBytes) return;
  if (const auto echo = echoes_.find(crc32c(datagram)); echo != echoes_.end()) {  // LCM hears what it sends itself
    echoes_.erase(echo);
    return;
  }
  Heard heard{channel, {datagram.begin(), datagram.end()}};
  if (heard_.size() < kKept)
    heard_.push_back(std::move(heard));
  else
    heard_[chance_() % kKept] = std::move(heard);
}

// Is welcomed by the daemon, as any robot of the fleet.
void LcmAttacker::meet(ByteSpan datagram) {
  const auto opened = own_->open(kMapChannel, datagram);
  const auto daemon = opened ? decode_lcm_map(opened->message) : Result<DaemonIdentity>(Reason::CORRUPT, "");
  if (daemon.ok() && own_->heard(daemon->boot, opened->seal, Clock::now())) (void)own_->welcome(*daemon, Clock::now());
}

void LcmAttacker::publish(const char* channel, const Bytes& datagram) {
  {
    const std::lock_guard lock(mutex_);
    echoes_.insert(crc32c(datagram));
  }
  ++sent_;
  link_->publish(channel, datagram);
}

// Something that it heard on a channel, or on any.
LcmAttacker::Heard LcmAttacker::heard_of(const char* channel) {
  const std::lock_guard lock(mutex_);
  for (int tries = 0; !heard_.empty() && tries < 50; ++tries)
    if (const Heard& one = heard_[chance_() % heard_.size()]; !channel || one.channel == std::string_view(channel))
      return one;
  return {channel ? channel : kGapChannel, Bytes(access::kSealBytes)};
}

// Without a welcome, nothing that it seals would be taken for its own.
void LcmAttacker::say_hello(const SessionUuid& session) {
  Bytes hello = encode_lcm(Hello{session});
  {
    const std::lock_guard lock(mutex_);
    if (!own_) return;
    own_->seal_hello(hello);
  }
  publish(kHelloChannel, hello);
}

// Sends the message without a seal, with one of another message, with a damaged one, or with its own.
void LcmAttacker::send(const char* channel, Bytes message) {
  const Heard other = heard_of(random_() % 2 ? channel : nullptr);
  switch (random_() % 4) {
    case 0:
      break;
    case 3: {
      const std::lock_guard lock(mutex_);
      if (own_ && own_->ready(Clock::now())) {
        own_->seal(channel, message);
        ++sealed_;
        break;
      }
      [[fallthrough]];
    }
    default:
      message.insert(message.end(), other.datagram.end() - access::kSealBytes, other.datagram.end());
      if (random_() % 2) message.back() ^= static_cast<std::uint8_t>(1 + random_() % 255);
  }
  publish(channel, message);
}

Keyframe LcmAttacker::forged_keyframe(const SessionUuid& session, std::uint32_t sequence) {
  Keyframe k = sample_keyframe();
  k.session.uuid = session;
  k.sequence = sequence;
  k.time_us = now_us() + 3'000'000'000'000'000;  // in a century
  k.tracks.clear();
  return k;
}

void LcmAttacker::forge() {
  const SessionUuid session = sessions_[random_() % sessions_.size()];
  if (sent_ % kHelloEvery == 0) say_hello(random_() % 2 ? session : SessionUuid::random());
  switch (random_() % 9) {
    case 0:
      return send(kGapChannel, encode_lcm(Gap{session, some() % 50, some() % 400 + 50, Reason::DROPPED_BY_ROBOT}));
    case 1:
      return send(kEndChannel, encode_lcm(SessionEnd{session, some() % 400}));
    case 2: {  // whole keyframes
      const std::uint32_t sequence = some() % 400;
      const Bytes payload = encode_keyframe(forged_keyframe(session, sequence));
      return send(kKeyframeChannel, encode_lcm(cut_part(session, sequence, payload, crc32c(payload), 60000, 0)));
    }
    case 3: {  // garbage under a right envelope
      const Heard part = heard_of(kKeyframeChannel);
      if (part.datagram.size() <= access::kSealBytes) return;
      const auto message = ByteSpan(part.datagram).first(part.datagram.size() - access::kSealBytes);
      auto changed = decode_lcm_part(message);
      if (!changed.ok() || changed->data.empty()) return;
      changed->data[random_() % changed->data.size()] ^= 1;
      changed->part_crc = part_checksum(*changed);
      return send(kKeyframeChannel, encode_lcm(*changed));
    }
    case 4: {  // an acknowledgement that settles everything, or forgets everything
      Acknowledgement ack;
      ack.session = session;
      ack.boot = boot();
      ack.next_sequence = random_() % 2 ? 0 : std::uint64_t{1} << 32;
      ack.credits = some() % 2 ? 0 : 64;
      if (random_() % 2) ack.refused.push_back({kWholeSession, 0, Reason::SESSION_DELETED});
      return send(kAckChannel, encode_lcm(ack));
    }
    case 5: {
      PoseNews news;
      news.session = session;
      news.boot = boot();
      news.kind = random_() % 2 ? PoseNews::Kind::kEnded : PoseNews::Kind::kSlowDown;
      news.rate_hz = 0.1;
      return send(kPoseChannel, encode_lcm(news));
    }
    case 6: {
      DaemonIdentity other{boot(), {}};
      other.map.uuid = SessionUuid::random();
      return send(kMapChannel, encode_lcm(other));
    }
    case 7:
      return send(kHelloChannel, encode_lcm(Hello{session}));
    default: {  // again, as it was heard, or on another channel
      const Heard again = heard_of(nullptr);
      publish(random_() % 4 ? again.channel : kAllChannels[random_() % std::size(kAllChannels)], again.datagram);
    }
  }
}

// Of the daemon, which tells it to everybody.
BootId LcmAttacker::boot() {
  const Heard map = heard_of(kMapChannel);
  const auto daemon = decode_lcm_map(map.datagram);
  return daemon.ok() ? daemon->boot : BootId{};
}

}  // namespace relmap::testing
