// The life of a loop closure in the map: proposed, weighed against its neighbours, accepted, bound, taken out
// (docs/method.md, 2 and 7). Every function is a pure function of the map and its arguments.
#pragma once

#include <functional>
#include <set>
#include <vector>

#include "server/map/consistency.h"
#include "storage/journal/journal_record.h"
#include "storage/map/map.h"

namespace relmap::map {

// The path between the ends of a new loop edge must have more edges than this; a closure between nearer frames only
// binds. Measured: docs/rba.md, Which closures become edges.
inline constexpr std::uint32_t kLoopEdgeSpacing = 16;
inline constexpr std::uint32_t kMaxLoopEdges = 8;  // from a frame to older ones, accepted and carrying

// What changed, and where relaxation has to start.
struct ClosureChange {
  std::vector<FrameId> seeds;        // both ends of every closure that came into force or went
  std::vector<EdgeId> accepted;      // came into force now
  std::vector<EdgeId> withdrawn;     // quarantined or removed now, some of them not in force before
  std::vector<EdgeId> out_of_force;  // those that were
  std::vector<EdgeId> lone;          // stored now, and await confirmation
  std::vector<storage::Edge> gone;   // were in force, and went with a session (state: removed)
};

// `sequence` is the record's in the journal, and goes into the history of every closure whose state it changes.
//
// Stores the proposal as a candidate with its bindings; accepts it, and candidates that it confirms, if they form a
// consistent set of at least two, none of which agrees with one that an operator has taken out near by. A proposal that
// is already stored changes nothing.
ClosureChange apply_proposal(storage::EditableGraph& map, std::uint64_t sequence,
                             const storage::ClosureProposalRecord& proposal,
                             std::uint32_t loop_edge_spacing = kLoopEdgeSpacing, const ConsistencyRules& rules = {});

// Adds bindings of an accepted closure in one more frame.
ClosureChange apply_binding(storage::EditableGraph& map, const storage::BindingRecord& record);

// Adds the frames with an observation that may mean another landmark, or come into force or go, once `closure` and
// others hold as `holds` tells. `known`: landmarks looked at before.
void add_bound(const storage::Graph& graph, const storage::Edge& closure, const std::function<bool(ClosureId)>& holds,
               std::set<LandmarkId>& known, std::set<FrameId>& frames);

// Accepted closures that could take over as edges when some that end in `newer_ends` go: those with an end above.
std::vector<EdgeId> stand_ins(const storage::Graph& graph, const std::vector<FrameId>& newer_ends);

// Makes edges of the graph of those of these closures that are accepted and join what is far apart (docs/method.md, 2),
// and appends their ends to `seeds`. Support is the caller's affair (change_support()).
void carry_where_needed(storage::EditableGraph& map, const std::set<EdgeId>& closures, std::uint32_t spacing,
                        std::vector<FrameId>* seeds);

// It is in force by an operator's word: no other closure outvotes it, and it needs none that agrees.
inline bool is_decided(const storage::Edge& edge) {
  return edge.state == storage::EdgeState::kAccepted && edge.reason == Reason::ACCEPTED_BY_OPERATOR;
}

// How many closures of a state there are.
std::uint64_t& closure_counter(storage::MapState& state, storage::EdgeState of);

// Whether no path leads from one frame to the other with so few edges that a closure between them would only bind.
bool far_apart(const storage::Graph& graph, FrameId a, FrameId b, std::uint32_t spacing);

// Whether the session of a frame is being deleted: it takes part in nothing new.
bool is_going(const storage::Graph& graph, FrameId frame);

}  // namespace relmap::map
