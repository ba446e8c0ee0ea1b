// A robot's keyframes through intake, journal and worker into a map on a disk that forgets what was not synced, while
// the power fails again and again.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "storage/engine/engine.h"

namespace relmap::testing {

// A disk and the engine on it.
class FailingDisk {
 public:
  virtual ~FailingDisk() = default;
  virtual Result<std::shared_ptr<storage::Engine>> open() = 0;
  virtual void fail_power_after(std::uint64_t operations) = 0;
  virtual bool has_power() const = 0;
  // The last journal record, of those from `first` on, that no failure of the power could take now.
  virtual std::uint64_t certain_through(std::uint64_t first) const = 0;
  // Once nothing holds the engine.
  virtual void restart() = 0;
};

struct PowerFailureRun {
  std::string wrong;  // what first broke the promises; empty: nothing
  std::uint32_t keyframes = 0;
  std::uint64_t acknowledged_at_failures = 0;  // keyframes that were acknowledged when the power failed, all together
  std::uint64_t commits = 0;
  std::uint64_t closures_accepted = 0;
};

// The power fails `failures` times at random, then everything comes in. Before each acknowledgement leaves, the sync
// that covers it must have returned (unless `watch` is off). After each failure the map on disk must verify clean, and
// every acknowledged keyframe must be there, as it was sent; at the end every keyframe once; and the journal, applied
// to an empty map, must give the very same map.
PowerFailureRun run_with_power_failures(FailingDisk& disk, int failures, std::uint64_t seed, bool watch = true);

}  // namespace relmap::testing
