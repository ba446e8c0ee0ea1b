// Deleting a session (docs/method.md, 2), chunk by chunk, the newest first: what is left of it is a session that ended
// earlier, and the map is whole after each.
//
// What others know by the frames that go stays with them:
//   - A landmark of the session is re-based in each pass of another session that sees it: the oldest landmark that is
//     the same there takes its place, with the estimate that it has now; where there is none, its first observer there
//     gets one. What else the pass has of it means that one from now on, whatever closures hold.
//   - Where the way between two frames led over the session and what is left is longer by more than kLoopEdgeSpacing
//     edges, a closure is put in its place: the chain's transform and covariance (Verification::kCompounded), which is
//     its prior, as nothing is observed along it.
#pragma once

#include <cstdint>
#include <optional>

#include "server/map/closures.h"
#include "storage/journal/journal_record.h"
#include "storage/map/map.h"

namespace relmap::map {

// The chunk that is to go next; nullopt: no frame is left.
std::optional<storage::RemoveChunkRecord> next_deletion(const storage::Session& session);

// Nothing for a session that is not being deleted, and for another than its last chunk. `sequence` is the record's.
ClosureChange apply_deletion(storage::Map& map, std::uint64_t sequence, const storage::RemoveChunkRecord& record,
                             std::uint32_t loop_edge_spacing = kLoopEdgeSpacing);

}  // namespace relmap::map
