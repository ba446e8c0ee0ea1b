// What an operator does to loop closures (docs/method.md, 7): takes one out, restores it, puts one into force by his
// word, takes that word back. Every function is a pure function of the graph and its arguments; a dry run is the same
// edit on a draft (storage/map/draft.h).
#pragma once

#include "server/map/closures.h"

namespace relmap::map {

enum class EdgeAction : std::uint8_t { kRemove, kRemoveAlone, kRestore, kAccept, kWithdraw };

storage::SetEdgeStateRecord edit_record(EdgeId closure, EdgeAction action, std::string note = {});
// UNSUPPORTED: the record says what no edit is.
Result<EdgeAction> action_of(const storage::SetEdgeStateRecord& record);

// Stands for the closures that a removal of `closure` would take out: their number times 2^32 plus the CRC-32C of their
// ids. Never 0. The closure must be there.
std::uint64_t removal_mark(const storage::Graph& graph, EdgeId closure);

// Why this edit is not possible: NO_SUCH_EDGE, ODOMETRY_EDGE, NO_SUCH_FRAME (an end was lost), SESSION_DELETED,
// WRONG_STATE (there is nothing to do, or another closure is in the way that an operator put into force, or others
// would be removed than the record's `shown` stands for), UNSUPPORTED (one to be put into force is not verified in
// metres).
Status check_edge_edit(const storage::Graph& graph, const storage::SetEdgeStateRecord& record);

// Nothing if check_edge_edit() says no. `sequence` is the record's in the journal.
//   remove    with all that are in force and agree with it, and with those, but for others that an operator decided on.
//             What agrees with one of them later stays a candidate
//   alone     it goes by itself. What agrees with it stays as it is, those too that came into force with it alone, and
//             is judged later as if there were no such closure: it neither vouches for others nor keeps them out
//   restore   with all that went with it, each to the state that it had; one that went alone comes back alone
//   accept    those that cannot stand beside it are quarantined; it is not outvoted, and needs none that agrees. If it
//             contradicts the odometry, the robot was carried in between (where_carried())
//   withdraw  what it was before it was accepted so. What it quarantined is back as it was, unless it has changed since
//             or closures in force stand against it now; what came into force by agreeing with it alone is a candidate
ClosureChange apply_edge_edit(storage::EditableGraph& map, std::uint64_t sequence,
                              const storage::SetEdgeStateRecord& record,
                              std::uint32_t loop_edge_spacing = kLoopEdgeSpacing);

}  // namespace relmap::map
