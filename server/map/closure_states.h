// Changes of closures' states, which everything that judges closures makes by the same steps (docs/method.md, 2 and 7).
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/map/closures.h"
#include "storage/graph/frame_range.h"

namespace relmap::map {

struct StateChange {
  EdgeId id;
  storage::EdgeState state;
  Reason reason;
  storage::FrameRange carried = {};  // along which it says that the robot was carried; session 0: as it was
  bool forget_carried = false;       // it says so no more
};

// What brings changes of state about.
struct Cause {
  std::uint64_t sequence;
  EdgeId closure;
  std::string note = {};
};

// Into the history: kMaxEvents at most are kept. An operator's words stay with the closure that he named.
void add_event(storage::Edge& edge, storage::EdgeState state, Reason reason, const Cause& cause);

// Changes the states of closures and everything that follows: edges of the graph, bindings in force, support.
ClosureChange change_states(storage::EditableGraph& map, const std::vector<StateChange>& changes, const Cause& cause,
                            std::uint32_t spacing);

// Stores with each of them that they agree.
void remember_agreement(storage::EditableGraph& map, EdgeId id, const std::vector<EdgeId>& agreeing);

// Of those that do not agree with `id`, the ones that it cannot stand beside. Where an accepted closure agrees with
// both they say the same, and one of them coarsely.
std::set<EdgeId> opponents(const storage::Graph& graph, EdgeId id, const std::vector<EdgeId>& conflicting,
                           const ConsistencyRules& rules = {});

// Adds accepted closures with which, once the `outvoted` are gone and `winners` (ascending) are in force, none that is
// accepted agrees: the set that they came in with is broken. Those that an operator decided on stand alone.
void add_left_alone(const storage::Graph& graph, const std::vector<EdgeId>& winners, std::set<EdgeId>& outvoted);

// One of them that an operator decided on; nullopt: none is.
std::optional<EdgeId> decided_among(const storage::Graph& graph, const std::set<EdgeId>& closures);

}  // namespace relmap::map
