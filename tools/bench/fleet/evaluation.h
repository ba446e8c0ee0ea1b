// Evaluates a run of a fleet: by the deeds of its robots, and by a client that asks the map for each frame.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "client/relmap_client.h"
#include "tools/bench/fleet/deeds.h"
#include "tools/bench/fleet/keyframes.h"

namespace relmap::bench {

struct RobotDeeds {
  std::uint64_t sent = 0;          // keyframes that were in its spool: sequences 0 .. sent - 1
  std::uint64_t acknowledged = 0;  // of them, as it has heard
  std::uint64_t refused = 0, given_up = 0;
  bool ended = false;  // as it should
  std::uint64_t part_bytes = 0;
  std::map<std::uint64_t, std::int64_t> pushed_ns;                      // by sequence; not of one killed just then
  std::vector<std::pair<std::uint64_t, std::int64_t>> acknowledged_ns;  // everything below, when; both growing

  // When it heard that `sequence` is settled.
  std::optional<std::int64_t> settled_ns(std::uint64_t sequence) const;
};

std::map<std::uint32_t, RobotDeeds> by_robot(const std::vector<Deed>& deeds);

// Latencies from push() to the acknowledgement, of keyframes pushed from `from_ns` to `to_ns`; infinity if a keyframe
// was never acknowledged.
std::vector<double> latencies_ms(const std::map<std::uint32_t, RobotDeeds>& robots, std::int64_t from_ns,
                                 std::int64_t to_ns);

// Keyframes pushed before `at_ns` that were not acknowledged by then.
std::uint64_t waiting_at(const std::map<std::uint32_t, RobotDeeds>& robots, std::int64_t at_ns);
// Keyframes pushed from `from_ns` on.
std::uint64_t pushed_since(const std::map<std::uint32_t, RobotDeeds>& robots, std::int64_t from_ns);

// Seconds from `at_ns` until everything pushed before it was settled; infinity if it never was.
double settled_after_s(const RobotDeeds& robot, std::int64_t at_ns);
double settled_after_s(const std::map<std::uint32_t, RobotDeeds>& robots, std::int64_t at_ns);

struct MapTally {
  std::uint64_t present = 0;  // sent, and in the map under its sequence and time
  std::uint64_t missing = 0;  // sent, and not in the map
  std::uint64_t doubled = 0;  // further frames for a robot and sequence, those of a second session among them
  std::uint64_t flooded = 0;  // of the robot that floods, in any number
  std::uint64_t strange = 0;  // frames that nobody sent, or with another time than what was sent
};

// Counts the frames of the map, asking for each. `sent`: number of keyframes of each robot; `flooder`: the robot whose
// frames are counted apart. Throws StatusError.
MapTally tally_map(client::Client& map, const std::vector<std::pair<FleetRobot, std::uint64_t>>& sent,
                   const FleetRobot& flooder);

}  // namespace relmap::bench
