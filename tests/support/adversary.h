// An adversary on the network of a fleet whose messages are sealed: it makes, in the robots' and the daemon's name,
// whatever it can of what it hears. Time is an argument, and the same seed makes the same of the same.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "frontend/publishing/lcm/sealed_daemon.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::testing {

// Hears everything and knows no key, or only its own. Not thread-safe.
class Adversary {
 public:
  using Time = std::chrono::steady_clock::time_point;
  struct Datagram {
    const char* channel = nullptr;
    Bytes bytes;
  };

  // Attacks these sessions, at least one.
  Adversary(std::vector<SessionUuid> sessions, std::uint64_t seed) : sessions_(std::move(sessions)), random_(seed) {}

  // A robot of the fleet that turned against the others: what it sends is sealed by its own key, too, and the daemon
  // welcomes it.
  void use(const access::RobotKey& own) { own_.emplace(own, 1); }

  // A datagram of somebody else. `channel` is one of channels.h.
  void hear(const char* channel, ByteSpan datagram, Time now);
  // What it sends next: gaps, ends, keyframes, spoilt parts, acknowledgements, news, the identity of another daemon,
  // hellos, and what it has heard, again.
  Datagram forge(Time now);

  std::size_t heard() const { return heard_.size(); }  // datagrams that it can use
  std::size_t sealed() const { return sealed_; }       // made, sealed by its own key

 private:
  void meet(ByteSpan datagram, Time now);
  Datagram hello(const SessionUuid& session);
  Datagram seal(const char* channel, Bytes message, Time now);
  const Datagram& heard_of(const char* channel);
  Keyframe forged_keyframe(const SessionUuid& session, std::uint32_t sequence);
  BootId boot();
  Uuid some_uuid();
  std::uint32_t some() { return static_cast<std::uint32_t>(random_()); }

  const std::vector<SessionUuid> sessions_;
  std::mt19937_64 random_;
  std::vector<Datagram> heard_;
  std::optional<publishing::SealedDaemon> own_;
  std::size_t made_ = 0, sealed_ = 0;
};

}  // namespace relmap::testing
