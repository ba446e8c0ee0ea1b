#include "tests/support/adversary.h"

#include <iterator>
#include <string_view>
#include <utility>

#include "proto/base/crc32c.h"
#include "proto/keyframe/keyframe_samples.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_messages.h"

namespace relmap::testing {

namespace {

constexpr const char* kAllChannels[] = {kKeyframeChannel, kGapChannel,  kEndChannel, kHelloChannel,
                                        kAckChannel,      kPoseChannel, kMapChannel};
constexpr std::size_t kKept = 4000;
constexpr std::size_t kHelloEvery = 500;  // datagrams

}  // namespace

void Adversary::hear(const char* channel, ByteSpan datagram, Time now) {
  if (own_ && std::string_view(channel) == kMapChannel) meet(datagram, now);
  if (datagram.size() < access::kSealBytes) return;
  Datagram heard{channel, {datagram.begin(), datagram.end()}};
  if (heard_.size() < kKept)
    heard_.push_back(std::move(heard));
  else
    heard_[random_() % kKept] = std::move(heard);
}

// Is welcomed by the daemon, as any robot of the fleet.
void Adversary::meet(ByteSpan datagram, Time now) {
  const auto opened = own_->open(kMapChannel, datagram);
  const auto daemon = opened ? decode_lcm_map(opened->message) : Result<DaemonIdentity>(Reason::CORRUPT, "");
  if (daemon.ok() && own_->heard(daemon->boot, opened->seal, now)) (void)own_->welcome(*daemon, now);
}

// Something that it heard on a channel, or on any.
const Adversary::Datagram& Adversary::heard_of(const char* channel) {
  static const Datagram nothing{kGapChannel, Bytes(access::kSealBytes)};
  for (int tries = 0; !heard_.empty() && tries < 50; ++tries)
    if (const Datagram& one = heard_[random_() % heard_.size()]; !channel || one.channel == std::string_view(channel))
      return one;
  return nothing;
}

// Without a welcome, nothing that it seals would be taken for its own.
Adversary::Datagram Adversary::hello(const SessionUuid& session) {
  Bytes hello = encode_lcm(Hello{session});
  own_->seal_hello(hello);
  return {kHelloChannel, std::move(hello)};
}

// The message without a seal, with one of another message, with a damaged one, or with its own.
Adversary::Datagram Adversary::seal(const char* channel, Bytes message, Time now) {
  const std::uint32_t kind = some() % 4;
  if (kind == 0) return {channel, std::move(message)};
  if (kind == 1 && own_ && own_->ready(now)) {
    own_->seal(channel, message);
    ++sealed_;
    return {channel, std::move(message)};
  }
  const Bytes& other = heard_of(some() % 2 ? channel : nullptr).bytes;
  message.insert(message.end(), other.end() - access::kSealBytes, other.end());
  if (some() % 2) message.back() ^= static_cast<std::uint8_t>(1 + some() % 255);
  return {channel, std::move(message)};
}

Keyframe Adversary::forged_keyframe(const SessionUuid& session, std::uint32_t sequence) {
  Keyframe k = sample_keyframe();
  k.session.uuid = session;
  k.sequence = sequence;
  k.time_us = 4'900'000'000'000'000;  // in the year 2125
  k.tracks.clear();
  k.appearance.clear();
  return k;
}

Adversary::Datagram Adversary::forge(Time now) {
  const SessionUuid session = sessions_[random_() % sessions_.size()];
  if (own_ && made_++ % kHelloEvery == 0) return hello(some() % 2 ? session : some_uuid());
  switch (some() % 9) {
    case 0: {
      const Gap gap{session, some() % 50, some() % 400 + 50, Reason::DROPPED_BY_ROBOT};
      return seal(kGapChannel, encode_lcm(gap), now);
    }
    case 1:
      return seal(kEndChannel, encode_lcm(SessionEnd{session, some() % 400}), now);
    case 2: {  // garbage under a right envelope
      const Datagram& part = heard_of(kKeyframeChannel);
      auto changed = decode_lcm_part(ByteSpan(part.bytes).first(part.bytes.size() - access::kSealBytes));
      if (changed.ok() && !changed->data.empty()) {
        changed->data[random_() % changed->data.size()] ^= 1;
        changed->part_crc = part_checksum(*changed);
        return seal(kKeyframeChannel, encode_lcm(*changed), now);
      }
      [[fallthrough]];
    }
    case 3: {  // whole keyframes
      const std::uint32_t sequence = some() % 400;
      const Bytes payload = encode_keyframe(forged_keyframe(session, sequence));
      return seal(kKeyframeChannel, encode_lcm(cut_part(session, sequence, payload, crc32c(payload), 60000, 0)), now);
    }
    case 4: {  // an acknowledgement that settles everything, or forgets everything
      Acknowledgement ack;
      ack.session = session;
      ack.boot = boot();
      ack.next_sequence = some() % 2 ? 0 : std::uint64_t{1} << 32;
      ack.credits = some() % 2 ? 0 : 64;
      if (some() % 2) ack.refused.push_back({kWholeSession, 0, Reason::SESSION_DELETED});
      return seal(kAckChannel, encode_lcm(ack), now);
    }
    case 5: {
      PoseNews news;
      news.session = session;
      news.boot = boot();
      news.kind = some() % 2 ? PoseNews::Kind::kEnded : PoseNews::Kind::kSlowDown;
      news.rate_hz = 0.1;
      return seal(kPoseChannel, encode_lcm(news), now);
    }
    case 6: {
      DaemonIdentity other{boot(), {}};
      other.map.uuid = some_uuid();
      return seal(kMapChannel, encode_lcm(other), now);
    }
    case 7:
      return seal(kHelloChannel, encode_lcm(Hello{session}), now);
    default: {  // again, as it was heard, or on another channel
      const Datagram& again = heard_of(nullptr);
      return {some() % 4 ? again.channel : kAllChannels[random_() % std::size(kAllChannels)], again.bytes};
    }
  }
}

Uuid Adversary::some_uuid() {
  Uuid uuid;
  for (std::uint8_t& byte : uuid.bytes) byte = static_cast<std::uint8_t>(random_());
  return uuid;
}

// Of the daemon, which tells it to everybody.
BootId Adversary::boot() {
  const auto daemon = decode_lcm_map(heard_of(kMapChannel).bytes);
  return daemon.ok() ? daemon->boot : BootId{};
}

}  // namespace relmap::testing
