// Streams the town's keyframes into a daemon that is killed now and then, and asks it for routes and places meanwhile.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/bench/vast/vast_town.h"

namespace relmap::bench {

// What was seen of the daemon, once a second.
struct VastSample {
  double s = 0;              // since the run began, without the time between its parts
  std::uint64_t frames = 0;  // in the map
  double update_p99_us = 0;  // of relative bundle adjustment, over the last updates
  double lookup_lag_s = 0;   // how long ago the frame that waits longest for its lookup came into the map
  double resident_mb = 0;
  std::uint64_t closures = 0;
};

// A question "where is this frame?", over RPC.
struct VastQuestion {
  std::uint64_t frames = 0;  // in the map
  double ms = 0;
};

// A run, as far as it has come. Kept in the folder, so that an interrupted run goes on.
struct VastProgress {
  double s = 0, cpu_s = 0;
  std::uint32_t kills = 0;
  std::vector<double> starts_s;  // of the daemon after each kill, until it served
  double peak_resident_mb = 0;
  std::vector<VastSample> samples;
  std::vector<double> route_ms;
  std::vector<VastQuestion> places;
  std::uint64_t routes_refused = 0, places_found = 0, places_wrong = 0;
};

// Drives the town to its end, or on from where the folder's run was interrupted. Returns when everything is durable,
// applied, relaxed and looked up, with the daemon stopped. The map is in FOLDER/map. Throws.
VastProgress drive_town(const VastTown& town, const VastOptions& options);

}  // namespace relmap::bench
