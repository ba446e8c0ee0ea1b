// Changes the states of closures, in the same steps for everything that judges closures (docs/method.md, 2 and 7).
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/map/closures.h"
#include "storage/graph/frame_range.h"
#include "storage/journal/journal_record.h"

namespace relmap::map {

struct StateChange {
  EdgeId id;
  storage::EdgeState state;
  Reason reason;
  storage::FrameRange carried = {};  // new value of Edge::carried; session 0: Edge::carried stays as it is
  bool forget_carried = false;       // clears Edge::carried
};

// What causes changes of state.
struct Cause {
  std::uint64_t sequence;              // of the journal record
  EdgeId closure;                      // the closure that was proposed or edited
  std::string note = {};               // an operator's
  storage::Submission submitted = {};  // of the record
};

// Adds an event to the edge's history, which keeps at most kMaxEvents. The note goes only to the closure that the
// operator named.
void add_event(storage::Edge& edge, storage::EdgeState state, Reason reason, const Cause& cause);

// Changes the states of closures and everything derived from them: edges of the graph, bindings in force, support.
// `spacing` as in kLoopEdgeSpacing.
ClosureChange change_states(storage::EditableGraph& map, const std::vector<StateChange>& changes, const Cause& cause,
                            std::uint32_t spacing);

// Stores with `id` and with each of `agreeing` that the two agree.
void remember_agreement(storage::EditableGraph& map, EdgeId id, const std::vector<EdgeId>& agreeing);

// Those of the `conflicting` closures that cannot be in force together with `id`. If an accepted closure agrees with
// both, they say the same and one of them is coarse: such a pair is left out.
std::set<EdgeId> opponents(const storage::Graph& graph, EdgeId id, const std::vector<EdgeId>& conflicting,
                           const ConsistencyRules& rules = {});

// Adds to `outvoted` the accepted closures that no accepted closure agrees with any more, once the `outvoted` are out
// of force and the `winners` (ascending) are in force: the set that they were accepted with is broken. Closures that an
// operator put into force need no other and are not added.
void add_left_alone(const storage::Graph& graph, const std::vector<EdgeId>& winners, std::set<EdgeId>& outvoted);

// One of the closures that an operator put into force; nullopt if there is none.
std::optional<EdgeId> decided_among(const storage::Graph& graph, const std::set<EdgeId>& closures);

}  // namespace relmap::map
