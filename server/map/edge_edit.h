// Edits of loop closures by an operator (docs/method.md, 7): remove one, restore it, put one into force, withdraw that.
// Every function is a pure function of the graph and its arguments; a dry run is the same edit on a draft
// (storage/map/draft.h).
#pragma once

#include "server/map/closures.h"

namespace relmap::map {

enum class EdgeAction : std::uint8_t { kRemove, kRemoveAlone, kRestore, kAccept, kWithdraw };

storage::SetEdgeStateRecord edit_record(EdgeId closure, EdgeAction action, std::string note = {});
// The action that a record describes. UNSUPPORTED if it describes none.
Result<EdgeAction> action_of(const storage::SetEdgeStateRecord& record);

// Whether the record removes a closure and all that agree with it. True also of one that describes no action because it
// is decided, too: check_edge_edit() refuses that.
bool removes_all(const storage::SetEdgeStateRecord& record);
// What needs no map: INVALID_ARGUMENT if the record has a `shown` and is not removes_all().
Status check_edge_record(const storage::SetEdgeStateRecord& record);

// Identifies the set of closures that a removal of `closure` would take out: their number times 2^32 plus the CRC-32C
// of their ids. Never 0. The closure must exist.
std::uint64_t removal_mark(const storage::Graph& graph, EdgeId closure);

// OK if this edit is possible. Otherwise NO_SUCH_EDGE, ODOMETRY_EDGE, NO_SUCH_FRAME (an end was lost), SESSION_DELETED,
// WRONG_STATE (there is nothing to do, or a closure that an operator put into force is in the way, or the closures that
// would be removed are not those of the record's `shown`), or UNSUPPORTED (the closure to be put into force is not
// verified in metres).
Status check_edge_edit(const storage::Graph& graph, const storage::SetEdgeStateRecord& record);

// Applies the edit; changes nothing if check_edge_edit() is not OK. `sequence` is the record's in the journal.
//   remove    Removes the closure and all closures in force that agree with it, directly or through one another, except
//             those that an operator put into force. A later proposal that agrees with one of them stays a candidate.
//   alone     Removes only the closure. Those that agree with it stay as they are, even if they came into force only
//             with it. Later proposals are judged as if it did not exist: it neither supports nor opposes them.
//   restore   Restores the closure and all that were removed with it, each to its former state. One that was removed
//             alone is restored alone.
//   accept    Puts the closure into force and quarantines those that cannot be in force together with it. From then on
//             it is not outvoted, and needs none that agrees. If it contradicts the odometry, it says that the robot
//             was carried in between (where_carried()).
//   withdraw  Returns the closure to its state before it was accepted. Those that it quarantined return to theirs,
//             unless they have changed since or closures in force oppose them now. Those that came into force only by
//             agreeing with it become candidates.
ClosureChange apply_edge_edit(storage::EditableGraph& map, std::uint64_t sequence,
                              const storage::SetEdgeStateRecord& record,
                              std::uint32_t loop_edge_spacing = kLoopEdgeSpacing);

// The refusal of an edit because the map changed between its check and its turn in the journal. WRONG_STATE.
Status overtaken();

}  // namespace relmap::map
