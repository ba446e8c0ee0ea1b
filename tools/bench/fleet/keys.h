// The keys by which a fleet's robots seal what they send over LCM.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

#include "proto/access/access_list.h"
#include "proto/access/datagram_seal.h"
#include "proto/base/hex.h"
#include "tools/bench/fleet/keyframes.h"

namespace relmap::bench {

// The random number of a robot's key, which here is none, so that each process can tell it.
inline access::SealKey drawn_for(std::uint32_t robot) {
  access::SealKey drawn{};
  drawn.fill(0x5a);
  for (std::size_t i = 0; i < sizeof robot; ++i) drawn[i] = static_cast<std::uint8_t>(robot >> 8 * i);
  return drawn;
}

inline access::RobotKey key_of(const access::SealKey& secret, std::uint32_t robot) {
  return access::robot_key(secret, drawn_for(robot));
}

// The line of the access list by which a daemon knows it.
inline access::Grant grant_of(const FleetRobot& robot) {
  constexpr std::int64_t kNever = 253'402'300'799;  // the end of the year 9999
  return {access::Grant::Kind::kKey, hex(drawn_for(robot.number)), {access::Role::kRobot, robot.name()}, kNever, false};
}

}  // namespace relmap::bench
