// An attacker on the multicast group of a fleet whose messages are sealed: it sends, in the robots' and the daemon's
// name, whatever it can make of what it hears.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <unordered_set>
#include <vector>

#include "frontend/publishing/lcm/sealed_daemon.h"
#include "proto/keyframe/keyframe.h"
#include "proto/wire/lcm_link.h"

namespace relmap::testing {

// Hears everything and knows no key, or only its own.
class LcmAttacker {
 public:
  // Attacks these sessions, at least one. Throws.
  LcmAttacker(const std::string& url, std::vector<SessionUuid> sessions, std::uint64_t seed);
  ~LcmAttacker();

  // A robot of the fleet that turned against the others: what it sends is sealed by its own key, too, and the daemon
  // welcomes it.
  void use(const access::RobotKey& own);

  // Sends one message: gaps, ends, keyframes, spoilt parts, acknowledgements, news, the identity of another daemon,
  // hellos, and what it has heard, again.
  void forge();

  std::size_t sent() const { return sent_; }
  std::size_t sealed() const { return sealed_; }  // of these, sealed by its own key
  std::size_t heard() const;                      // messages of others that it can use

 private:
  struct Heard {
    const char* channel;
    Bytes datagram;
  };

  void record(const char* channel, ByteSpan datagram);
  void meet(ByteSpan datagram);
  void say_hello(const SessionUuid& session);
  void publish(const char* channel, const Bytes& datagram);
  void send(const char* channel, Bytes message);
  Heard heard_of(const char* channel);
  Keyframe forged_keyframe(const SessionUuid& session, std::uint32_t sequence);
  BootId boot();
  std::uint32_t some() { return static_cast<std::uint32_t>(random_()); }

  const std::vector<SessionUuid> sessions_;
  std::mt19937_64 random_;  // of forge()
  std::atomic<std::size_t> sent_ = 0, sealed_ = 0;
  mutable std::mutex mutex_;  // of all below, which the link's thread uses
  std::mt19937_64 chance_;
  std::vector<Heard> heard_;
  std::optional<publishing::SealedDaemon> own_;
  std::unordered_multiset<std::uint32_t> echoes_;  // checksums of what it has sent and not heard yet
  std::unique_ptr<LcmLink> link_;
};

}  // namespace relmap::testing
