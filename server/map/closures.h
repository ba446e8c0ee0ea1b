// The life of a loop closure in the map: it is proposed, weighed against its neighbours, accepted, binds landmarks, and
// may be taken out (docs/method.md, 2 and 7). Every function is a pure function of the map and its arguments.
#pragma once

#include <functional>
#include <set>
#include <vector>

#include "server/map/consistency.h"
#include "storage/journal/journal_record.h"
#include "storage/map/map.h"

namespace relmap::map {

// A closure becomes an edge of the graph only if the path between its ends has more edges than this; otherwise it only
// binds landmarks. Measured in docs/rba.md, Which closures become edges.
inline constexpr std::uint32_t kLoopEdgeSpacing = 16;
inline constexpr std::uint32_t kMaxLoopEdges = 8;  // edges of the graph from one frame to older ones by closures

// What a record changed, and where relaxation has to start.
struct ClosureChange {
  std::vector<FrameId> seeds;        // both ends of every closure that came into force or went out of force
  std::vector<EdgeId> accepted;      // came into force now
  std::vector<EdgeId> withdrawn;     // quarantined, removed or made candidates now, whether in force before or not
  std::vector<EdgeId> out_of_force;  // those of `withdrawn` that were in force
  std::vector<EdgeId> lone;          // stored now, and await confirmation by another closure
  std::vector<storage::Edge> gone;   // were in force, and were deleted with a session (state: removed)
  std::vector<EdgeId> deleted;       // all that were deleted with a session, whatever their state, ascending
  std::vector<EdgeId> stand_in;      // bridges over these, and closures that became edges of the graph in their place

  // Adds what another change of the same record did after this one.
  void append(const ClosureChange& next);
};

// Stores the proposal as a candidate with its bindings. Accepts it, together with candidates that it confirms, if they
// form a consistent set of at least two, or if it is beyond doubt alone (beyond_doubt.h). A proposal that agrees with a
// closure near by that an operator has taken out stays a candidate. A proposal that is already stored changes nothing.
// `sequence` is that of the journal record; it goes into the history of every closure whose state changes.
ClosureChange apply_proposal(storage::EditableGraph& map, std::uint64_t sequence,
                             const storage::ClosureProposalRecord& proposal,
                             std::uint32_t loop_edge_spacing = kLoopEdgeSpacing, const ConsistencyRules& rules = {});

// Adds bindings of an accepted closure in one more frame. Changes nothing if the closure is not accepted.
ClosureChange apply_binding(storage::EditableGraph& map, const storage::BindingRecord& record);

// Notes that the frame saw nothing of where the closure leads (unseen.h). When more frames have seen nothing than
// closures agree, the closure and those that agree with it go out of force (NOT_SEEN_BEYOND), and are no witnesses any
// more. Changes nothing if the closure is not accepted, or if an operator put one of them into force.
ClosureChange apply_unseen(storage::EditableGraph& map, std::uint64_t sequence, const storage::UnseenRecord& record,
                           std::uint32_t loop_edge_spacing = kLoopEdgeSpacing);

// Adds to `frames` every frame with an observation whose landmark or validity changes through bindings of `closure`, if
// exactly the closures for which `holds` returns true are in force. `known` holds the landmarks that have been
// examined, and grows.
void add_bound(const storage::Graph& graph, const storage::Edge& closure, const std::function<bool(ClosureId)>& holds,
               std::set<LandmarkId>& known, std::set<FrameId>& frames);

// Accepted closures that are not edges of the graph but could become edges when edges that end in `newer_ends` go:
// those with an end in frames_above(newer_ends).
std::vector<EdgeId> stand_ins(const storage::Graph& graph, const std::vector<FrameId>& newer_ends);

// Makes edges of the graph of those closures that are accepted and whose ends are far apart (docs/method.md, 2), and
// appends their ends to `seeds`. The caller updates support (change_support()).
void carry_where_needed(storage::EditableGraph& map, const std::set<EdgeId>& closures, std::uint32_t spacing,
                        std::vector<FrameId>* seeds);

// Whether an operator put the closure into force. No other closure outvotes it, and it needs none that agrees.
inline bool is_decided(const storage::Edge& edge) {
  return edge.state == storage::EdgeState::kAccepted && edge.reason == Reason::ACCEPTED_BY_OPERATOR;
}

// The number of closures in a state.
std::uint64_t& closure_counter(storage::MapState& state, storage::EdgeState of);

// Whether no path of at most `spacing` edges joins the two frames, so that a closure between them becomes an edge.
bool far_apart(const storage::Graph& graph, FrameId a, FrameId b, std::uint32_t spacing);

// Whether the map took in frame `a` before frame `b`. It has both.
bool taken_in_before(const storage::Graph& graph, FrameId a, FrameId b);

// Whether the frame's session is being deleted. Such a frame takes part in nothing new.
bool is_going(const storage::Graph& graph, FrameId frame);

}  // namespace relmap::map
