// What happens to robots on their way in, for the log.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "proto/base/ids.h"

namespace relmap::intake {

struct RobotEvent {
  enum class Kind : std::uint8_t {
    kHeard,     // keyframes of the session come in, for the first time, or again after a silence or a restart
    kSilent,    // nothing came for a while, and it has not said that this was all
    kSameName,  // another robot of this name brings a session of its own at the same time
  };
  Kind kind = Kind::kHeard;
  SessionUuid uuid;
  SessionNumber session = 0;
  std::string robot, name;          // of the session's header
  std::uint64_t next_sequence = 0;  // everything below is settled
  std::chrono::seconds silent{0};   // since it was heard last
};

}  // namespace relmap::intake
