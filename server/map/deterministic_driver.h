// Deterministic mode. What follows from a record (the lookup of a new frame, slices of the remaining relaxation, chunks
// of sessions that are being deleted) is journalled and applied right after it, before the next record is taken. So the
// same input gives the same map, however fast the machine is.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/status.h"
#include "server/map/lookup_queue.h"
#include "storage/journal/journal_record.h"

namespace relmap::map {

// Not thread-safe: for the worker, or the thread that starts it.
class DeterministicDriver {
 public:
  struct Hooks {
    // Makes a record durable and returns its sequence; nullopt if the disk did not take it before the daemon stopped.
    std::function<std::optional<std::uint64_t>(const storage::JournalRecord&)> append;
    // Applies the record to the map. Throws what the map throws.
    std::function<void(std::uint64_t sequence, const storage::JournalRecord&)> apply;
    std::function<std::vector<storage::JournalRecord>(FrameId)> look_up;
    std::function<bool()> relaxation_pending;
    std::function<std::optional<storage::RemoveChunkRecord>()> next_removal;
  };
  // Relaxation records after each record, at most: enough for a loop closure.
  static constexpr int kSlices = 16;

  // `slice` is the counted work of one relaxation record.
  DeterministicDriver(std::uint64_t slice, LookupQueue& lookups, Hooks hooks);

  struct Outcome {
    std::uint64_t last = 0;  // sequence of the last record that followed, or `sequence` if none did
    Status trouble;          // not ok: a lookup failed, or a record could not be applied
  };
  // Looks up `frame` (the one that record `sequence` added, if any), relaxes in at most `slices` records, then removes
  // chunks of sessions that are being deleted. Journals and applies each step.
  Outcome follow_up(std::uint64_t sequence, std::optional<FrameId> frame, int slices = kSlices);

 private:
  bool append_and_apply(const storage::JournalRecord& record, Outcome& outcome);
  void relax(int slices, Outcome& outcome);

  const std::uint64_t slice_;
  LookupQueue& lookups_;
  const Hooks hooks_;
};

}  // namespace relmap::map
