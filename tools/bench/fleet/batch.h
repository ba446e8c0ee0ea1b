// Ready-made keyframes into a daemon as fast as it takes them: some recordings at a time, each by the front-end's
// publisher over gRPC with a spool in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "proto/keyframe/keyframe.h"

namespace relmap::bench {

// Light content: about 44 tracks and 45 features, no picture.
inline constexpr std::size_t kLightKeyframeBytes = 8'000;

// Publishes the keyframes of one session to the daemon with this data folder or address, and waits until it has settled
// all. Throws.
void publish(const std::string& server, const SessionHeader& session, const std::vector<Keyframe>& keyframes);

struct BatchLoad {
  std::uint32_t keyframes = 0;   // of all recordings together
  std::uint32_t recordings = 4;  // at a time
  std::size_t memory_budget_mb = 1024;
  bool relax = true, closures = true;
  std::uint64_t seed = 1;
};

struct BatchSpeed {
  double durable_per_s = 0;  // from the first push until the last acknowledgement
  double done_per_s = 0;     // until all is applied and looked up
};

// `folder`: for the map; must not exist. Throws.
BatchSpeed run_batch(const std::string& folder, const BatchLoad& load);

}  // namespace relmap::bench
