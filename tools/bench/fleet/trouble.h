// Trouble-makers for a fleet: a robot that sends far faster than it may, a sender of garbage, and one who forges what
// the others say.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "proto/keyframe/ingest_messages.h"
#include "proto/wire/lcm_link.h"
#include "tests/support/lcm_attacker.h"
#include "tools/bench/fleet/keyframes.h"

namespace relmap::bench {

// Sends parts of valid keyframes regardless of its credits: the 64 that the daemon would take next, again and again.
class Flooder {
 public:
  // Throws. `lap` outlives it.
  Flooder(const std::string& lcm_url, const FleetLap& lap, FleetRobot robot, double keyframes_per_s,
          std::uint32_t part_bytes);
  ~Flooder();
  std::uint64_t sent() const { return sent_; }  // keyframes

 private:
  void run();

  const FleetLap& lap_;
  const FleetRobot robot_;
  const double keyframes_per_s_;
  const std::uint32_t part_bytes_;
  std::atomic<std::uint64_t> next_ = 0, sent_ = 0;
  std::atomic<bool> stopping_ = false;
  std::unique_ptr<LcmLink> link_;
  std::thread thread_;
};

// Random bytes, cut and damaged messages, absurd counts, keyframes of strangers that never become whole or are wrong.
class GarbageSender {
 public:
  GarbageSender(const std::string& lcm_url, double messages_per_s, std::uint64_t seed);  // throws
  ~GarbageSender();
  std::uint64_t sent() const { return sent_; }

 private:
  void run();
  void send_one();
  KeyframePart part_of_a_stranger(std::size_t payload_bytes, bool right_crc);

  const double messages_per_s_;
  std::mt19937_64 random_;
  std::atomic<std::uint64_t> sent_ = 0;
  std::atomic<bool> stopping_ = false;
  std::unique_ptr<LcmLink> link_;
  std::thread thread_;
};

// Forges, spoils and repeats what the robots and the daemon say (tests/support/adversary.h), at a rate.
class Forger {
 public:
  // `own`: the key of a robot of the fleet, which the forger is, too. Throws.
  Forger(const std::string& lcm_url, std::vector<SessionUuid> sessions, const access::RobotKey& own,
         double messages_per_s, std::uint64_t seed);
  ~Forger();
  std::size_t sent() const { return attacker_.sent(); }

 private:
  const double messages_per_s_;
  std::atomic<bool> stopping_ = false;
  testing::LcmAttacker attacker_;
  std::thread thread_;
};

}  // namespace relmap::bench
