#include "tests/support/hand_robot.h"

#include <thread>

#include "proto/base/crc32c.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_messages.h"
#include "tests/support/patience.h"

namespace relmap::testing {

namespace {
constexpr std::uint32_t kPartBytes = 4096;
}

HandRobot::HandRobot(const std::string& lcm_url, const SessionUuid& session) : session_(session) {
  const auto take = [this](ByteSpan message) {
    auto ack = decode_lcm_acknowledgement(message);
    if (!ack.ok() || ack->session != session_) return;
    const std::lock_guard lock(mutex_);
    newest_ = std::move(*ack);
  };
  link_ = LcmLink::open(lcm_url, {{kAckChannel, take}}).or_throw();
}

void HandRobot::say(const KeyframePart& part) { say_bytes(kKeyframeChannel, encode_lcm(part)); }
void HandRobot::say(const Gap& gap) { say_bytes(kGapChannel, encode_lcm(gap)); }
void HandRobot::say_bytes(const char* channel, const Bytes& message) { link_->publish(channel, message); }

void HandRobot::say_payload(std::uint32_t sequence, const Bytes& payload, std::optional<std::uint32_t> left_out) {
  for (std::uint32_t i = 0; i < count_parts(payload.size(), kPartBytes); ++i)
    if (i != left_out) say(part(sequence, payload, i));
}

KeyframePart HandRobot::part(std::uint32_t sequence, const Bytes& payload, std::uint32_t index) const {
  return cut_part(session_, sequence, payload, crc32c(payload), kPartBytes, index);
}

std::optional<Acknowledgement> HandRobot::acknowledgement() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

bool HandRobot::until(const std::function<void()>& what, const std::function<bool(const Acknowledgement&)>& done) {
  return repeat_until(what, [&] {
    const auto ack = acknowledgement();
    return ack && done(*ack);
  });
}

bool HandRobot::settle(std::uint32_t sequence, const Bytes& payload) {
  return until([&] { say_payload(sequence, payload); },
               [&](const Acknowledgement& ack) { return ack.next_sequence > sequence; });
}

Reason HandRobot::refusal(std::uint32_t sequence) const {
  const auto ack = acknowledgement();
  if (ack)
    for (const Refused& refused : ack->refused)
      if (refused.sequence == sequence) return refused.reason;
  return Reason::OK;
}

bool repeat_until(const std::function<void()>& what, const std::function<bool()>& done) {
  using std::chrono::milliseconds;
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < deadline) {
    what();
    for (int i = 0; i < 20; ++i) {
      if (done()) return true;
      std::this_thread::sleep_for(milliseconds(5));
    }
  }
  return done();
}

}  // namespace relmap::testing
