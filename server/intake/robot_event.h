// Events of robots that send keyframes, for the log.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "proto/base/ids.h"

namespace relmap::intake {

struct RobotEvent {
  enum class Kind : std::uint8_t {
    kHeard,     // keyframes of the session come in for the first time, or again after a silence or a restart
    kSilent,    // nothing came for a while, although the robot has not ended the session
    kSameName,  // another robot of this name sends another session at the same time
  };
  Kind kind = Kind::kHeard;
  SessionUuid uuid;
  SessionNumber session = 0;
  std::string robot, name;          // from the session's header
  std::uint64_t next_sequence = 0;  // everything below is settled
  std::chrono::seconds silent{0};   // time since the robot was last heard
};

}  // namespace relmap::intake
