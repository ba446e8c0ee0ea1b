#include "tools/bench/fleet/trouble.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <utility>

#include "proto/base/crc32c.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_messages.h"
#include "tools/bench/stopwatch.h"

namespace relmap::bench {

namespace {

constexpr std::chrono::milliseconds kBreath{2};
constexpr std::uint32_t kTakenAhead = 64;  // keyframes that the daemon takes ahead of what it has settled
constexpr std::size_t kDataLengthAt = 68;  // in an encoded keyframe_part_t
constexpr std::size_t kMaxBytes = 1400;

// Calls `act` at a rate, until it is stopped; what it could not keep up with is not made up for.
template <typename Act>
void at_rate(double per_s, const std::atomic<bool>& stopping, Act act) {
  auto before = Clock::now();
  for (double due = 0; !stopping; std::this_thread::sleep_for(kBreath)) {
    const auto now = Clock::now();
    due = std::min(due + per_s * std::chrono::duration<double>(now - before).count(), 1 + per_s * 0.05);
    before = now;
    for (; due >= 1 && !stopping; --due) act();
  }
}

}  // namespace

Flooder::Flooder(const std::string& lcm_url, const FleetLap& lap, FleetRobot robot, double keyframes_per_s,
                 std::uint32_t part_bytes)
    : lap_(lap), robot_(robot), keyframes_per_s_(keyframes_per_s), part_bytes_(part_bytes) {
  const auto hear = [this](ByteSpan message) {
    const auto ack = decode_lcm_acknowledgement(message);
    if (ack.ok() && ack->session == robot_.uuid()) next_ = std::max<std::uint64_t>(next_, ack->next_sequence);
  };
  link_ = LcmLink::open(lcm_url, {{kAckChannel, hear}}).or_throw();
  thread_ = std::thread([this] { run(); });
}

Flooder::~Flooder() {
  stopping_ = true;
  thread_.join();
}

void Flooder::run() {
  struct Ready {
    Bytes payload;
    std::uint32_t crc = 0;
  };
  std::map<std::uint32_t, Ready> ready;
  std::uint32_t made = 0;
  SE3 T_odom;
  std::uint32_t at = 0;
  at_rate(keyframes_per_s_, stopping_, [&] {
    const auto next = static_cast<std::uint32_t>(next_);
    ready.erase(ready.begin(), ready.lower_bound(next));
    while (made < next + kTakenAhead) {
      const Keyframe keyframe = lap_.keyframe(robot_, made, T_odom);
      T_odom = keyframe.T_odom_frame;
      Bytes payload = encode_keyframe(keyframe);
      const std::uint32_t crc = crc32c(payload);
      if (made >= next) ready[made] = {std::move(payload), crc};
      ++made;
    }
    auto chosen = ready.upper_bound(at);
    if (chosen == ready.end()) chosen = ready.begin();
    at = chosen->first;
    const auto& [payload, crc] = chosen->second;
    for (std::uint32_t part = 0; part < count_parts(payload.size(), part_bytes_); ++part)
      link_->publish(kKeyframeChannel, encode_lcm(cut_part(robot_.uuid(), at, payload, crc, part_bytes_, part)));
    ++sent_;
  });
}

GarbageSender::GarbageSender(const std::string& lcm_url, double messages_per_s, std::uint64_t seed)
    : messages_per_s_(messages_per_s), random_(seed), link_(LcmLink::open(lcm_url, {}).or_throw()) {
  thread_ = std::thread([this] { run(); });
}

GarbageSender::~GarbageSender() {
  stopping_ = true;
  thread_.join();
}

void GarbageSender::run() {
  at_rate(messages_per_s_, stopping_, [this] {
    send_one();
    ++sent_;
  });
}

KeyframePart GarbageSender::part_of_a_stranger(std::size_t payload_bytes, bool right_crc) {
  Bytes payload(payload_bytes);
  for (std::uint8_t& byte : payload) byte = static_cast<std::uint8_t>(random_());
  const std::uint32_t crc = crc32c(payload) + (right_crc ? 0 : 1);
  return cut_part(SessionUuid::random(), static_cast<std::uint32_t>(random_() % 100), payload, crc, kNetworkPartBytes,
                  0);
}

void GarbageSender::send_one() {
  const auto below = [this](std::size_t limit) { return static_cast<std::size_t>(random_() % limit); };
  switch (below(9)) {
    case 0: {  // random bytes
      Bytes noise(1 + below(kMaxBytes));
      for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random_());
      return link_->publish(below(2) == 0 ? kKeyframeChannel : kGapChannel, noise);
    }
    case 1: {  // cut short
      Bytes part = encode_lcm(part_of_a_stranger(1000, true));
      part.resize(below(part.size()));
      return link_->publish(kKeyframeChannel, part);
    }
    case 2: {  // a type of message that nobody knows
      Bytes part = encode_lcm(part_of_a_stranger(1000, true));
      part[below(8)] ^= 0xff;
      return link_->publish(kKeyframeChannel, part);
    }
    case 3: {  // more data than there could be
      Bytes part = encode_lcm(part_of_a_stranger(1000, true));
      std::fill_n(part.begin() + kDataLengthAt, 4, std::uint8_t{0x7f});
      return link_->publish(kKeyframeChannel, part);
    }
    case 4: {  // a damaged part
      Bytes part = encode_lcm(part_of_a_stranger(1000, true));
      part[kDataLengthAt + 4 + below(1000)] ^= 1;
      return link_->publish(kKeyframeChannel, part);
    }
    case 5:  // a whole keyframe that fails its checksum
      return link_->publish(kKeyframeChannel, encode_lcm(part_of_a_stranger(1000, false)));
    case 6:  // one that keeps it, and is none
      return link_->publish(kKeyframeChannel, encode_lcm(part_of_a_stranger(1000, true)));
    case 7:  // one part of many; the others never come
      return link_->publish(kKeyframeChannel, encode_lcm(part_of_a_stranger(kMaxKeyframeBytes, true)));
    default:  // a gap of everything
      return link_->publish(kGapChannel, encode_lcm(Gap{SessionUuid::random(), 0, UINT32_MAX - 1}));
  }
}

Forger::Forger(const std::string& lcm_url, std::vector<SessionUuid> sessions, const access::RobotKey& own,
               double messages_per_s, std::uint64_t seed)
    : messages_per_s_(messages_per_s), attacker_(lcm_url, std::move(sessions), seed) {
  attacker_.use(own);
  thread_ = std::thread([this] { at_rate(messages_per_s_, stopping_, [this] { attacker_.forge(); }); });
}

Forger::~Forger() {
  stopping_ = true;
  thread_.join();
}

}  // namespace relmap::bench
