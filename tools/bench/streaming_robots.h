// Robots that stream simulated drives to a daemon, each a relmap-frontend of its own.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/process.h"

namespace relmap::bench {

class StreamingRobots {
 public:
  // Starts `count` robots, robot-0, robot-1, ..., that send `rate_hz` keyframes a second each to `server`. Their drives
  // are made in `folder`, which keeps their logs, too; robots share a few drives. Throws if a drive cannot be made.
  StreamingRobots(const std::string& folder, const std::string& server, std::uint32_t count, double rate_hz);

 private:
  std::vector<std::unique_ptr<testing::Process>> robots_;  // end when they are destroyed
};

}  // namespace relmap::bench
