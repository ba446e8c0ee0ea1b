// Judges how the daemon is: what is wrong with storage, worker and intake, and whether it lives.
#pragma once

#include <cstdint>
#include <string>

#include "proto/base/status.h"
#include "server/map/mapper.h"
#include "server/rpc/core.h"

namespace relmap::monitor {

// A thread that has been at one piece of work for longer is STALLED. The longest that a sound disk and a busy machine
// took in tests was 1.5 s.
inline constexpr double kStalled_s = 3;

struct Signs {
  map::MapperProgress map;
  Status lcm;           // why LCM ingest does not run, though it was asked for
  double intake_s = 0;  // IngestServer::busy_s()
  // Of the disk of the data folder; with less than the mark free nothing is taken in.
  std::uint64_t free_bytes = UINT64_MAX, low_water = 0;
  bool stopping = false;  // the daemon ends, and takes nothing more in
  double hung_after_s = 10;
};

// A commit takes as long as the disk needs, and keyframes are taken in meanwhile; but none takes so long.
inline constexpr double kCommitHung_s = 600;

// The components and `live` of HealthFacts.
rpc::HealthFacts judge(const Signs& signs);

// The page of /livez or /readyz: "ok", "not live" or "not ready", a line for each component, and one for the clock if
// it was set within the last hour.
std::string health_page(const rpc::HealthFacts& health, bool ready_asked);

// One line for systemd and the log: "ok", or what is wrong.
std::string in_short(const rpc::HealthFacts& health);

}  // namespace relmap::monitor
