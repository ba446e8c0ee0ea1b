// A fleet of robots over a bad network into a daemon (fleet_bench.cc), for other benchmarks, too.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "proto/keyframe/ingest_messages.h"
#include "tools/bench/fleet/relay.h"
#include "tools/bench/report.h"

namespace relmap::bench {

struct FleetOptions {
  std::uint32_t robots = 20;
  double rate = 5, seconds = 300;
  RelayFaults faults{0.05, 0.05, 0.01};
  std::size_t keyframe_bytes = 45'000;
  std::uint32_t part_bytes = kNetworkPartBytes;
  std::size_t memory_budget_mb = 1024;
  std::uint32_t kill_daemon = 0, kill_robots = 0, kills_each = 1;
  double flood = 0, garbage_hz = 0;
  double forgeries_hz = 0;  // only of a fleet that is sealed
  bool closures = true;
  bool sealed = false;  // robots prove who they are, and daemon and robots believe nothing else
  std::uint32_t batch = 20'000;
  std::uint64_t seed = 1;
  std::string folder;
};

// Runs the fleet in the network of this process, and reports all but the batch. Throws.
void run_fleet(const FleetOptions& options, Report& report);

}  // namespace relmap::bench
