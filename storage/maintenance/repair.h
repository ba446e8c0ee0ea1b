// Makes a damaged map whole again, and says what that cost. What is broken is moved to quarantine, what is derived is
// rebuilt, and references to what is lost are mended. A sound map is left as it is.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "proto/base/status.h"
#include "storage/engine/engine.h"
#include "storage/graph/frame_range.h"
#include "storage/maintenance/finding.h"

namespace relmap::storage {

struct RepairOptions {
  std::size_t memory_bytes = std::size_t{64} << 20;
};

struct RecordRange {
  std::uint64_t first = 0, last = 0;
  bool operator==(const RecordRange&) const = default;
};

struct RepairSummary {
  bool changed = false;    // false: the map was sound and is untouched
  bool salvaged = false;   // the store was copied, because parts of it could not be read any more
  std::string quarantine;  // the folder to which broken things were moved; empty: none were

  std::vector<SessionNumber> lost_sessions;
  std::vector<FrameRange> lost_frames;            // recorded as gaps, with reason DATA_LOSS
  std::vector<RecordRange> lost_records;          // of the journal
  std::uint64_t frames_without_observations = 0;  // their warm part was lost
  std::uint64_t frames_without_appearance = 0;    // their cold part was lost
  std::uint64_t frames_without_words = 0;         // the daemon makes them anew when it starts
  std::uint64_t dropped_observations = 0;         // of landmarks that are gone
  std::uint64_t dropped_claims = 0;
  std::uint64_t quarantined_edges = 0;  // closures with a lost frame
  std::uint64_t bridges = 0;            // prior edges over lost frames, by the robot's own odometry
  std::uint64_t rebuilt = 0;            // derived items that were wrong
  std::uint64_t remaining = 0;          // findings of a last verify; anything but 0 is a bug of repair itself
};

// For a map that no daemon works on: takes the engine over, and leaves it committed. Broken records go to files in the
// folder `quarantine`, which is made when it is needed. If interrupted at any point, it can be run again. IO_ERROR,
// STALE_OWNER; DATA_LOSS if nothing can be saved.
//
// storage/rocksdb/repair_folder.h does this for a data folder, damaged files of RocksDB and of the journal included.
Result<RepairSummary> repair(const std::shared_ptr<Engine>& engine, const std::string& quarantine,
                             const RepairOptions& options, const OnFinding& on_finding, const OnProgress& on_progress);

}  // namespace relmap::storage
