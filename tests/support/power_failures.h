// Sends a robot's keyframes through intake, journal and worker into a map on a disk that forgets what was not synced,
// with repeated power failures.
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
  // The last journal record, of those from `first` on, that a power failure can no longer take away.
  virtual std::uint64_t certain_through(std::uint64_t first) const = 0;
  // To be called after the engine is destroyed.
  virtual void restart() = 0;
};

struct PowerFailureRun {
  std::string wrong;  // the first broken promise; empty if there is none
  std::uint32_t keyframes = 0;
  std::uint64_t acknowledged_at_failures = 0;  // acknowledged keyframes at each power failure, summed
  std::uint64_t commits = 0;
  std::uint64_t closures_accepted = 0;
};

// The power fails `failures` times at random; then the remaining keyframes are sent. Checks that
//   - the sync that covers an acknowledgement has returned before it is sent (unless `watch` is false);
//   - after each failure the map on disk verifies, and has every acknowledged keyframe as it was sent;
//   - at the end every keyframe is in the map once, and the journal, applied to an empty map, gives the same map.
PowerFailureRun run_with_power_failures(FailingDisk& disk, int failures, std::uint64_t seed, bool watch = true);

}  // namespace relmap::testing
