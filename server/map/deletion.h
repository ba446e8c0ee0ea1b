// Deletes a session (docs/method.md, 2) chunk by chunk, the newest first. After each chunk the map is complete: what is
// left of the session is one that ended earlier.
//
// What other sessions know through the deleted frames stays with them:
//   - A landmark of the session is re-based in each pass of another session that sees it. The oldest landmark of the
//     pass that stands for it takes its place, with the deleted one's present estimate; if there is none, the first
//     observer of the pass gets a new landmark. All that the pass has of the deleted landmark means this one from now
//     on, independent of closures.
//   - If the path between two frames led over the session and the remaining path is longer by more than
//     kLoopEdgeSpacing edges, a bridge replaces it: a closure with the transform and covariance of the chain
//     (Verification::kCompounded). These are its prior, since nothing is observed along it.
//   - That a robot was carried, as a closure with the session showed by the way around, stays known: a closure with the
//     robot's own past (Verification::kCompounded) says it from then on.
#pragma once

#include <cstdint>
#include <optional>

#include "server/map/closures.h"
#include "storage/journal/journal_record.h"
#include "storage/map/map.h"

namespace relmap::map {

// The next chunk to remove, 0 while only records of skipped sequences are left; nullopt if nothing is left but the
// session's own record, or the session is not being deleted.
std::optional<storage::RemoveChunkRecord> next_deletion(const storage::Session& session);

// Removes a chunk or, if no frame is left, some of the records of skipped sequences. Changes nothing if the session is
// not being deleted, or if the chunk is not its last. `sequence` is the record's in the journal.
ClosureChange apply_deletion(storage::Map& map, std::uint64_t sequence, const storage::RemoveChunkRecord& record,
                             std::uint32_t loop_edge_spacing = kLoopEdgeSpacing);

}  // namespace relmap::map
