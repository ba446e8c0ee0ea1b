// Deterministic mode: what follows from a record (the lookup of a new frame, a slice of the relaxation that is left, a
// chunk of a session that is being deleted) is journalled and applied right after it, before the next record is taken.
// So the same input gives the same map, whatever the machine has time for.
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
    // Makes a record durable, and gives its sequence; nullopt: the disk did not take it before the
    // daemon stops, or takes nothing while it starts.
    std::function<std::optional<std::uint64_t>(const storage::JournalRecord&)> append;
    // Applies it to the map. Throws what the map throws.
    std::function<void(std::uint64_t sequence, const storage::JournalRecord&)> apply;
    std::function<std::vector<storage::JournalRecord>(FrameId)> look_up;
    std::function<bool()> relaxation_pending;
    std::function<std::optional<storage::RemoveChunkRecord>()> next_removal;
  };
  // At most so many relaxation records after each record: enough for a loop closure, and bounded.
  static constexpr int kSlices = 16;

  // `slice`: counted work of one record of relaxation.
  DeterministicDriver(std::uint64_t slice, LookupQueue& lookups, Hooks hooks);

  struct Outcome {
    std::uint64_t last = 0;  // sequence of the last record that followed; if none did, the `sequence` passed in
    Status trouble;          // not ok: something that follows could not be found or applied
  };
  // Looks up `frame` (the one that record `sequence` added, if any), relaxes in at most `slices` records, then takes
  // out chunks of sessions that are being deleted. Each step is journalled and applied here.
  Outcome follow_up(std::uint64_t sequence, std::optional<FrameId> frame, int slices = kSlices);

 private:
  bool append_and_apply(const storage::JournalRecord& record, Outcome& outcome);
  void relax(int slices, Outcome& outcome);

  const std::uint64_t slice_;
  LookupQueue& lookups_;
  const Hooks hooks_;
};

}  // namespace relmap::map
