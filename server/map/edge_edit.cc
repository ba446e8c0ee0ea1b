#include "server/map/edge_edit.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <set>
#include <span>

#include "proto/base/bytes.h"
#include "proto/base/crc32c.h"
#include "server/map/carried_stretch.h"
#include "server/map/carrying.h"
#include "server/map/closure_states.h"
#include "server/map/consistency.h"
#include "server/map/own_motion.h"
#include "server/place/map_points.h"
#include "storage/map/draft.h"

namespace relmap::map {

namespace {

// The closure, and all for which `join` is true that agree with it, directly or through others of the set.
std::vector<storage::Edge> joined_set(const storage::Graph& graph, EdgeId named,
                                      const std::function<bool(const storage::Edge&)>& join) {
  std::vector<storage::Edge> set{*storage::find_edge(graph, named)};
  std::set<EdgeId> seen{named};
  for (std::size_t i = 0; i < set.size(); ++i)
    for (const EdgeId other : std::vector<EdgeId>(set[i].consistent_with))
      if (seen.insert(other).second)
        if (auto edge = storage::find_edge(graph, other); edge && join(*edge)) set.push_back(std::move(*edge));
  return set;
}

// Closures that agree with a wrong one are wrong too. One that an operator put into force is only removed by name.
std::vector<StateChange> removal(const storage::Graph& graph, EdgeId named) {
  std::vector<StateChange> changes;
  for (const storage::Edge& edge : joined_set(graph, named, [](const storage::Edge& other) {
         return other.state == storage::EdgeState::kAccepted && !is_decided(other);
       }))
    changes.push_back({edge.id, storage::EdgeState::kRemoved,
                       edge.id == named ? Reason::REMOVED_BY_OPERATOR : Reason::REMOVED_WITH_SET});
  return changes;
}

Status check_shown(const storage::Graph& graph, EdgeId named, std::uint64_t shown) {
  if (shown == 0) return {};
  const std::uint64_t now = removal_mark(graph, named);
  if (now == shown) return {};
  const auto closures = [](std::uint64_t mark) {
    return std::to_string(mark >> 32) + (mark >> 32 == 1 ? " closure" : " closures");
  };
  return {Reason::WRONG_STATE, "the map has changed since the removal of " + named.to_string() +
                                   " was shown: " + closures(shown) + " would have gone then, " +
                                   (now >> 32 == shown >> 32 ? "others now" : closures(now) + " now") +
                                   "; nothing is changed, look again"};
}

std::vector<StateChange> removal_alone(EdgeId named) {
  return {{named, storage::EdgeState::kRemoved, Reason::REMOVED_ALONE}};
}

// The state of a removed closure before its removal, by the first `end` events of its history.
StateChange as_before_removal(const storage::Edge& edge, std::size_t end) {
  const auto events = std::span(edge.history).first(end);
  for (auto event = events.rbegin(); event != events.rend(); ++event)
    if (event->state != storage::EdgeState::kRemoved) return {edge.id, event->state, event->reason};
  return {edge.id, storage::EdgeState::kAccepted, Reason::CONSISTENT};  // taken out before histories were kept
}

std::vector<StateChange> restoration(const storage::Graph& graph, EdgeId named) {
  if (const storage::Edge edge = *storage::find_edge(graph, named); edge.reason == Reason::REMOVED_ALONE)
    return {as_before_removal(edge, edge.history.size())};
  std::vector<StateChange> changes;
  for (const storage::Edge& edge : joined_set(graph, named, [](const storage::Edge& other) {
         return other.state == storage::EdgeState::kRemoved && other.reason == Reason::REMOVED_WITH_SET;
       }))
    changes.push_back(as_before_removal(edge, edge.history.size()));
  return changes;
}

// Index in the history of the event by which an operator put the closure into force. It may have been removed and
// restored since.
std::size_t decision(const storage::Edge& decided) {
  std::size_t found = decided.history.size() - 1;
  for (std::size_t i = found; i-- > 0;) {
    if (decided.history[i].reason == Reason::ACCEPTED_BY_OPERATOR)
      found = i;
    else if (decided.history[i].state != storage::EdgeState::kRemoved)
      break;
  }
  return found;
}

// Whether the closure had been accepted with a set that says where the robot was carried before the operator put it
// into force. Edge::carried is then not due to the operator.
bool said_carried_before(const storage::Edge& decided) {
  const auto before = std::span(decided.history).first(decision(decided));
  return std::any_of(before.begin(), before.end(),
                     [](const storage::EdgeEvent& event) { return event.reason == Reason::CARRIED; });
}

StateChange as_before(const storage::Edge& edge, std::size_t event) {
  if (event == 0) return {edge.id, storage::EdgeState::kCandidate, Reason::LONE};
  return {edge.id, edge.history[event - 1].state, edge.history[event - 1].reason};
}

// The closures that the operator's decision put out of force and that have not changed since.
std::vector<storage::Edge> put_out_by(const storage::Graph& graph, const storage::Edge& decided) {
  const std::uint64_t sequence = decided.history[decision(decided)].journal_sequence;
  const auto by_it = [&](const storage::Edge& edge) {
    return edge.kind == storage::EdgeKind::kLoop && edge.state == storage::EdgeState::kQuarantined &&
           edge.history.size() > 1 && edge.history.back().journal_sequence == sequence;
  };
  std::vector<storage::Edge> found;
  std::set<EdgeId> seen{decided.id};
  for (const place::PlacedFrame& near :
       place::along_odometry(graph, decided.b, ConsistencyRules().reach, ConsistencyRules().reach,
                             [](const storage::Edge& step) { return std::optional<storage::Edge>(step); })) {
    const auto hot = graph.hot(near.frame);
    for (const storage::Edge& edge : hot->edges) {
      if (!by_it(edge) || seen.contains(edge.id)) continue;
      for (storage::Edge& member : joined_set(graph, edge.id, by_it))  // with those of add_left_alone()
        if (seen.insert(member.id).second) found.push_back(std::move(member));
    }
  }
  return found;
}

std::set<EdgeId> opponents_now(const storage::Graph& graph, EdgeId id) {
  return opponents(graph, id, test_consistency(graph, *storage::find_edge(graph, id)).conflicting);
}

// The closures in force that agree with a ride stated by an operator and would not be accepted as evidence for it
// without him (weigh_carrying()).
std::vector<EdgeId> on_the_word_alone(const storage::Graph& graph, const storage::Edge& decided) {
  std::vector<EdgeId> followers;
  for (const storage::Edge& edge : joined_set(graph, decided.id, [&](const storage::Edge& other) {
         return other.state == storage::EdgeState::kAccepted && !is_decided(other) && other.carried == decided.carried;
       }))
    if (edge.id != decided.id) followers.push_back(edge.id);
  std::sort(followers.begin(), followers.end());
  if (followers.size() < 2) return followers;
  storage::Draft without(graph);
  followers.push_back(decided.id);
  for (const EdgeId id : followers) {
    take_out_carrier(without, *storage::find_edge(graph, id));
    without.edit_hot(id.frame).edge(id)->carried = {};
  }
  followers.pop_back();
  return weigh_carrying(without, followers).speaks_for_carrying() ? std::vector<EdgeId>() : followers;
}

std::vector<StateChange> withdrawal(const storage::Graph& graph, const storage::Edge& decided) {
  std::vector<StateChange> changes{as_before(decided, decision(decided))};
  changes.front().forget_carried = !said_carried_before(decided);
  const bool in_force = changes.front().state == storage::EdgeState::kAccepted;
  std::vector<EdgeId> back;
  for (const storage::Edge& edge : put_out_by(graph, decided)) {
    std::set<EdgeId> against = opponents_now(graph, edge.id);
    if (!in_force) against.erase(decided.id);
    if (!against.empty()) continue;
    changes.push_back(as_before(edge, edge.history.size() - 1));
    if (changes.back().state == storage::EdgeState::kAccepted) back.push_back(edge.id);
  }
  if (in_force) return changes;
  std::sort(back.begin(), back.end());
  std::set<EdgeId> alone{decided.id}, of_the_word;
  if (changes.front().forget_carried && decided.carried.session != 0)
    for (const EdgeId id : on_the_word_alone(graph, decided)) of_the_word.insert(id);
  alone.insert(of_the_word.begin(), of_the_word.end());
  add_left_alone(graph, back, alone);
  alone.erase(decided.id);
  for (const EdgeId id : alone) {
    const bool said_carried = of_the_word.contains(id);
    changes.push_back({id, storage::EdgeState::kCandidate, said_carried ? Reason::CONTRADICTS_MOTION : Reason::LONE});
    changes.back().forget_carried = said_carried;
  }
  return changes;
}

ClosureChange withdraw(storage::EditableGraph& map, const storage::Edge& decided, const Cause& cause,
                       std::uint32_t spacing) {
  const std::vector<StateChange> changes = withdrawal(map, decided);
  if (changes.front().state == storage::EdgeState::kRemoved) {
    // Keeps its state before the removal in the history, for a restoration.
    const StateChange before = as_before_removal(decided, decision(decided));
    add_event(*map.edit_hot(decided.id.frame).edge(decided.id), before.state, before.reason, cause);
  }
  return change_states(map, changes, cause, spacing);
}

// Where the robot was carried if an operator is right about a closure that contradicts the odometry. Closures that
// agree with it narrow the stretch down although they are not in force; if they leave none, the closure alone counts.
storage::FrameRange carried_by_word(const storage::Graph& graph, EdgeId id, const std::vector<EdgeId>& agreeing,
                                    const std::set<EdgeId>& outvoted) {
  std::vector<EdgeId> ride{id};
  for (const EdgeId other : agreeing) {
    const auto edge = storage::find_edge(graph, other);
    if (contradicts_odometry(*edge) && edge->state != storage::EdgeState::kAccepted && own_motion(*edge) &&
        edge->b.session == id.frame.session)
      ride.push_back(other);
  }
  std::sort(ride.begin(), ride.end());
  const storage::FrameRange together = where_carried(graph, ride, outvoted);
  return together.session != 0 ? together : where_carried(graph, {id}, outvoted);
}

// The consequences of an operator putting a closure into force.
struct Word {
  std::vector<EdgeId> agreeing;
  std::set<EdgeId> against;     // closures that cannot be in force together with it
  storage::FrameRange carried;  // new value of Edge::carried; session 0: it stays as it is
};

Word word_on(const storage::Graph& graph, EdgeId id) {
  const storage::Edge closure = *storage::find_edge(graph, id);
  const Neighbourhood near = test_consistency(graph, closure);
  storage::Draft with_it(graph);
  remember_agreement(with_it, id, near.agreeing);  // until now it was compared only with closures that contradict too
  Word word{near.agreeing, opponents(with_it, id, near.conflicting), {}};
  const MotionTest motion = test_motion(graph, closure);
  if (motion.verdict == MotionVerdict::kDenies) word.against.insert(motion.carriers.begin(), motion.carriers.end());
  // If it contradicts the odometry, the operator says that the robot was carried. If a set with this closure has said
  // where before, that stays.
  if (motion.verdict != MotionVerdict::kContradicts || closure.carried.session != 0) return word;
  word.carried = carried_by_word(graph, id, near.agreeing, {});
  if (word.carried.session != 0) {
    // Closures on either side of the ride agree with the odometry. They can be in force together with this one once the
    // path between them crosses the ride as this one measured it.
    say_carried(with_it, id, word.carried);
    word.against = opponents(with_it, id, test_consistency(with_it, *storage::find_edge(with_it, id)).conflicting);
  } else {
    word.carried = carried_by_word(graph, id, near.agreeing, word.against);
  }
  return word;
}

ClosureChange accept(storage::EditableGraph& map, EdgeId id, const Cause& cause, std::uint32_t spacing) {
  Word word = word_on(map, id);
  remember_agreement(map, id, word.agreeing);
  // Some may have come into force since the closure was judged.
  std::uint16_t& opposing = map.edit_hot(id.frame).edge(id)->tests.opposing;
  opposing = std::max(opposing, static_cast<std::uint16_t>(std::min<std::size_t>(word.against.size(), 0xffff)));
  add_left_alone(map, {id}, word.against);
  std::vector<StateChange> changes;
  for (const EdgeId other : word.against)
    changes.push_back({other, storage::EdgeState::kQuarantined, Reason::INCONSISTENT});
  changes.push_back({id, storage::EdgeState::kAccepted, Reason::ACCEPTED_BY_OPERATOR, word.carried});
  return change_states(map, changes, cause, spacing);
}

Status in_the_way(EdgeId of, EdgeId decided) {
  return {Reason::WRONG_STATE, of.to_string() + " cannot stand beside " + decided.to_string() +
                                   ", which an operator put into force: take that out first"};
}

Status check_restoration(const storage::Graph& graph, const storage::Edge& closure) {
  if (closure.state != storage::EdgeState::kRemoved)
    return {Reason::WRONG_STATE, closure.id.to_string() + " was not removed: there is nothing to restore"};
  for (const StateChange& change : restoration(graph, closure.id)) {
    if (change.state != storage::EdgeState::kAccepted) continue;
    if (const auto decided = decided_among(graph, opponents_now(graph, change.id)))
      return in_the_way(change.id, *decided);
  }
  return {};
}

Status check_acceptance(const storage::Graph& graph, const storage::Edge& closure) {
  if (is_decided(closure))
    return {Reason::WRONG_STATE, closure.id.to_string() + " has been put into force by an operator already"};
  if (!storage::is_metric(closure.verification))
    return {Reason::UNSUPPORTED,
            closure.id.to_string() + (closure.verification == storage::Verification::kNone
                                          ? " was never verified: nothing says how far its ends are from each other"
                                          : " is verified by epipolar geometry alone, which measures no metres")};
  if (const auto decided = decided_among(graph, word_on(graph, closure.id).against))
    return in_the_way(closure.id, *decided);
  return {};
}

}  // namespace

storage::SetEdgeStateRecord edit_record(EdgeId closure, EdgeAction action, std::string note) {
  storage::SetEdgeStateRecord record;
  record.edge = closure;
  record.alone = action == EdgeAction::kRemoveAlone;
  record.state = action == EdgeAction::kRemove || record.alone ? storage::EdgeState::kRemoved
                 : action == EdgeAction::kWithdraw             ? storage::EdgeState::kCandidate
                                                               : storage::EdgeState::kAccepted;
  record.decided = action == EdgeAction::kAccept;
  record.note = std::move(note);
  return record;
}

Result<EdgeAction> action_of(const storage::SetEdgeStateRecord& record) {
  if (!record.decided && record.state == storage::EdgeState::kRemoved)
    return record.alone ? EdgeAction::kRemoveAlone : EdgeAction::kRemove;
  if (record.state == storage::EdgeState::kAccepted && !record.alone)
    return record.decided ? EdgeAction::kAccept : EdgeAction::kRestore;
  if (record.state == storage::EdgeState::kCandidate && !record.decided && !record.alone) return EdgeAction::kWithdraw;
  return {Reason::UNSUPPORTED,
          "a loop closure can only be removed, restored, put into force, or left to the vote again"};
}

bool removes_all(const storage::SetEdgeStateRecord& record) {
  return record.state == storage::EdgeState::kRemoved && !record.alone;
}

Status check_edge_record(const storage::SetEdgeStateRecord& record) {
  if (record.shown == 0 || removes_all(record)) return {};
  return {Reason::INVALID_ARGUMENT, "shown is only allowed in the removal of a closure and all that agree with it"};
}

std::uint64_t removal_mark(const storage::Graph& graph, EdgeId closure) {
  std::vector<EdgeId> going;
  for (const StateChange& change : removal(graph, closure)) going.push_back(change.id);
  std::sort(going.begin(), going.end());
  ByteWriter w;
  for (const EdgeId id : going) {
    w.put(id.frame.session);
    w.put(id.frame.index);
    w.put(id.ordinal);
  }
  return std::uint64_t{going.size()} << 32 | crc32c(w.take());
}

Status check_edge_edit(const storage::Graph& graph, const storage::SetEdgeStateRecord& record) {
  const auto action = action_of(record);
  if (!action.ok()) return action.status();
  const std::string name = record.edge.to_string();
  const auto edge = storage::find_edge(graph, record.edge);
  if (!edge) return {Reason::NO_SUCH_EDGE, "no edge " + name};
  if (edge->kind != storage::EdgeKind::kLoop)
    return {Reason::ODOMETRY_EDGE, name + " is an edge of the robot's own motion; only loop closures can be edited"};
  if (!graph.hot(edge->a)) return {Reason::NO_SUCH_FRAME, name + " led to " + edge->a.to_string() + ", which is lost"};
  for (const FrameId end : {edge->a, edge->b})
    if (is_going(graph, end))
      return {Reason::SESSION_DELETED,
              name + " belongs to session " + std::to_string(end.session) + ", which is being deleted"};
  switch (*action) {
    case EdgeAction::kRemove:
    case EdgeAction::kRemoveAlone:
      if (edge->state == storage::EdgeState::kRemoved) return {Reason::WRONG_STATE, name + " is removed already"};
      return *action == EdgeAction::kRemove ? check_shown(graph, record.edge, record.shown) : Status();
    case EdgeAction::kRestore:
      return check_restoration(graph, *edge);
    case EdgeAction::kAccept:
      return check_acceptance(graph, *edge);
    case EdgeAction::kWithdraw:
      if (!is_decided(*edge))
        return {Reason::WRONG_STATE, name + " was not put into force by an operator: there is nothing to withdraw"};
      return {};
  }
  return {};
}

ClosureChange apply_edge_edit(storage::EditableGraph& map, std::uint64_t sequence,
                              const storage::SetEdgeStateRecord& record, std::uint32_t loop_edge_spacing) {
  if (!check_edge_edit(map, record).ok()) return {};
  const Cause cause{sequence, record.edge, record.note, record.submitted};
  switch (*action_of(record)) {
    case EdgeAction::kRemove:
      return change_states(map, removal(map, record.edge), cause, loop_edge_spacing);
    case EdgeAction::kRemoveAlone:
      return change_states(map, removal_alone(record.edge), cause, loop_edge_spacing);
    case EdgeAction::kRestore:
      return change_states(map, restoration(map, record.edge), cause, loop_edge_spacing);
    case EdgeAction::kAccept:
      return accept(map, record.edge, cause, loop_edge_spacing);
    case EdgeAction::kWithdraw:
      return withdraw(map, *storage::find_edge(map, record.edge), cause, loop_edge_spacing);
  }
  return {};
}

Status overtaken() {
  return {Reason::WRONG_STATE, "the map has changed meanwhile, and the edit changed nothing: ask again"};
}

}  // namespace relmap::map
