#include "server/map/closures.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <set>
#include <unordered_set>

#include "server/map/beyond_doubt.h"
#include "server/map/carried_stretch.h"
#include "server/map/carrying.h"
#include "server/map/closure_states.h"
#include "server/map/consistency.h"
#include "server/map/look_alike.h"
#include "server/map/own_motion.h"
#include "server/map/sorted.h"
#include "server/map/support.h"
#include "server/map/unmeasured_steps.h"
#include "server/place/uniqueness.h"
#include "storage/graph/binding.h"
#include "storage/graph/local_graph.h"
#include "storage/graph/observers.h"
#include "storage/map/draft.h"

namespace relmap::map {

namespace {

constexpr std::size_t kMaxOfOneRide = 128;  // closures that are weighed together
constexpr std::size_t kMinUnseen = 8;       // frames that saw nothing of where closures lead; fewer may be a lorry
constexpr std::size_t kMaxClaims = 4;       // of a landmark: the first in force counts, the others take over if it goes

void set_state(storage::Edge& edge, storage::EdgeState state, Reason reason, const Cause& cause) {
  edge.state = state;
  edge.reason = reason;
  add_event(edge, state, reason, cause);
}

bool can_be_bound(const storage::Graph& graph, LandmarkId id) {
  const auto hot = graph.hot(id.base);
  return hot && id.slot < hot->landmarks.size() && !is_going(graph, id.base);
}

// Stores the claim that the landmark of observation `index` of `frame` is `target`, or, if `target` is invalid, that it
// is not needed. False if there was nothing to store.
bool store_claim(storage::EditableGraph& map, FrameId frame, std::size_t index, LandmarkId target, ClosureId closure) {
  const auto warm = map.warm(frame);
  if (index >= warm->observations.size() || !warm->observations[index].is_tracked()) return false;
  const LandmarkId self = warm->observations[index].landmark;
  if (target.valid() && (self == target || !taken_in_before(map, target.base, self.base))) return false;
  {
    const auto base = map.hot(self.base);  // nobody else may hold the frame
    const auto& claims = base->landmarks[self.slot].claims;
    const bool known = std::any_of(claims.begin(), claims.end(), [&](const storage::AliasClaim& claim) {
      return claim.target == target && claim.closure == closure;
    });
    if (known || claims.size() >= kMaxClaims) return false;
  }
  map.edit_hot(self.base).landmarks[self.slot].claims.push_back({target, closure});
  return true;
}

using Landmarks = std::unordered_set<LandmarkId>;

// What the frame's observations mean.
Landmarks meanings_seen(const storage::Graph& graph, FrameId frame) {
  Landmarks seen;
  const auto warm = graph.warm(frame);
  for (const storage::Observation& observation : warm->observations)
    seen.insert(storage::meaning_of(graph, observation.landmark).landmark);
  return seen;
}

// Stores that `frame` sees `binding.landmark` at a keypoint without a track, unless it has an observation of it
// already. `seen` is what its observations mean.
bool store_observation(storage::EditableGraph& map, FrameId frame, const storage::ProposedBinding& binding,
                       ClosureId closure, Landmarks& seen) {
  if (!seen.insert(storage::meaning_of(map, binding.landmark).landmark).second) return false;
  map.edit_warm(frame).observations.push_back(
      {binding.landmark, closure, binding.u_left, binding.v, binding.u_right, binding.level, binding.aligned});
  return true;
}

// Stores bindings as facts. Whether they are in force depends on the closure's state. Returns how many were stored.
std::size_t store_bindings(storage::EditableGraph& map, FrameId frame, ClosureId closure,
                           const std::vector<storage::ProposedBinding>& bindings) {
  std::size_t stored = 0;
  std::optional<Landmarks> seen;  // a claim may change it
  for (const storage::ProposedBinding& binding : bindings) {
    if (binding.landmark.valid() ? !can_be_bound(map, binding.landmark) : binding.track < 0) continue;
    if (binding.track >= 0) {
      if (!store_claim(map, frame, static_cast<std::size_t>(binding.track), binding.landmark, closure)) continue;
      seen.reset();
    } else {
      if (!seen) seen = meanings_seen(map, frame);
      if (!store_observation(map, frame, binding, closure, *seen)) continue;
    }
    ++stored;
  }
  if (stored == 0) return 0;
  storage::Edge& edge = *map.edit_hot(closure.frame).edge(closure);
  edge.bound = static_cast<std::uint16_t>(std::min<std::size_t>(edge.bound + stored, 0xffff));
  insert_sorted(edge.bound_frames, frame);
  return stored;
}

std::size_t loop_edges_from(const storage::Graph& graph, FrameId frame) {
  const auto hot = graph.hot(frame);
  return static_cast<std::size_t>(std::count_if(hot->edges.begin(), hot->edges.end(), [](const storage::Edge& edge) {
    return edge.kind == storage::EdgeKind::kLoop && edge.in_graph();
  }));
}

// Whether an accepted closure becomes an edge of the present graph (docs/method.md, 2).
bool should_carry(const storage::Graph& graph, const storage::Edge& closure, std::uint32_t spacing) {
  // What a deletion left of a ride (deletion.h) only tells that the robot was carried.
  const bool only_tells = closure.verification == storage::Verification::kCompounded && closure.carried.session != 0;
  const bool fits =
      storage::is_metric(closure.verification) && closure.verification != storage::Verification::kPnP && !only_tells;
  return fits && far_apart(graph, closure.a, closure.b, spacing) && loop_edges_from(graph, closure.b) < kMaxLoopEdges;
}

// Mean duration and speed of the odometry edges in a frame's chunk; docs/method.md, 8.
struct Pace {
  double seconds = 0, metres = 0;
  std::size_t edges = 0;
};
void add_pace(const storage::Graph& graph, FrameId frame, Pace& pace) {
  const std::uint32_t first = storage::chunk_of(frame) * storage::kFramesPerChunk;
  for (std::uint32_t index = first; index < first + storage::kFramesPerChunk; ++index) {
    const auto hot = graph.hot({frame.session, index});
    if (!hot || hot->edges.empty() || hot->edges.front().kind != storage::EdgeKind::kOdometry) continue;
    pace.seconds += hot->edges.front().driven_s;
    pace.metres += hot->edges.front().T_ab.t.norm();
    ++pace.edges;
  }
}
float loop_duration(const storage::Graph& graph, const storage::Edge& closure) {
  Pace pace;
  add_pace(graph, closure.a, pace);
  if (storage::chunk_of(closure.a) != storage::chunk_of(closure.b) || closure.a.session != closure.b.session)
    add_pace(graph, closure.b, pace);
  if (pace.edges == 0 || pace.metres <= 0) return 0;
  const double mean = pace.seconds / static_cast<double>(pace.edges);
  return static_cast<float>(std::max(mean, closure.T_ab.t.norm() * pace.seconds / pace.metres));
}

void count_states(storage::MapState& state, storage::EdgeState from, storage::EdgeState to) {
  --closure_counter(state, from);
  ++closure_counter(state, to);
}

}  // namespace

void ClosureChange::append(const ClosureChange& next) {
  const auto add = [](auto& all, const auto& more) { all.insert(all.end(), more.begin(), more.end()); };
  add(seeds, next.seeds);
  add(accepted, next.accepted);
  add(withdrawn, next.withdrawn);
  add(out_of_force, next.out_of_force);
  add(lone, next.lone);
  add(gone, next.gone);
  add(deleted, next.deleted);
  add(stand_in, next.stand_in);
  sort_unique(seeds);
}

void add_event(storage::Edge& edge, storage::EdgeState state, Reason reason, const Cause& cause) {
  if (edge.history.size() >= storage::kMaxEvents) edge.history.erase(edge.history.begin() + 1);
  edge.history.push_back({cause.sequence, state, reason, cause.closure,
                          edge.id == cause.closure ? cause.note : std::string(), cause.submitted.time_us,
                          cause.submitted.author});
}

ClosureChange change_states(storage::EditableGraph& map, const std::vector<StateChange>& changes, const Cause& cause,
                            std::uint32_t spacing) {
  ClosureChange result;
  std::set<LandmarkId> landmarks;
  std::set<FrameId> frames;   // whose observations may stand for another landmark, or be reached by another path
  std::set<FrameId> ends;     // the newer ends of edges that may come or go
  std::set<EdgeId> to_carry;  // closures that may become edges, in the order of their ids
  // When an edge goes, a closure that only bound may have to become an edge.
  const bool withdrawing = std::any_of(changes.begin(), changes.end(), [](const StateChange& change) {
    return change.state != storage::EdgeState::kAccepted;
  });
  // Only the reason changes, not the state: nothing else follows.
  const auto stays = [](const storage::Edge& edge, const StateChange& change) {
    return edge.state == storage::EdgeState::kAccepted && change.state == storage::EdgeState::kAccepted;
  };
  const auto holds_after = [&](ClosureId id) {
    for (const StateChange& change : changes)
      if (change.id == id) return change.state == storage::EdgeState::kAccepted;
    return storage::closure_holds(map, id);
  };
  for (const StateChange& change : changes) {
    const auto edge = storage::find_edge(map, change.id);
    if (stays(*edge, change)) continue;
    add_bound(map, *edge, holds_after, landmarks, frames);
    // What comes into force changes what the query measures; its place takes part as far as the change ripples.
    result.seeds.push_back(edge->b);
    if (change.state == storage::EdgeState::kAccepted) {
      result.accepted.push_back(change.id);
      to_carry.insert(change.id);
      if (withdrawing || should_carry(map, *edge, spacing)) ends.insert(edge->b);
    } else {
      result.seeds.push_back(edge->a);
      result.withdrawn.push_back(change.id);
      if (edge->state == storage::EdgeState::kAccepted) result.out_of_force.push_back(change.id);
      if (!edge->in_graph()) continue;
      ends.insert(edge->b);
      for (const EdgeId id : stand_ins(map, {edge->b})) {
        to_carry.insert(id);
        ends.insert(id.frame);
      }
    }
  }
  add_frames_beyond(map, {ends.begin(), ends.end()}, &frames);

  const std::vector<EdgeId> unused = change_support(map, frames, [&] {
    for (const StateChange& change : changes) {
      storage::Edge& edge = *map.edit_hot(change.id.frame).edge(change.id);
      count_states(map.state(), edge.state, change.state);
      if (edge.state == storage::EdgeState::kAccepted) take_out_carrier(map, storage::Edge(edge));
      if (!stays(edge, change)) edge.carries = false;
      set_state(edge, change.state, change.reason, cause);
      if (change.carried.session != 0 || change.forget_carried) edge.carried = change.carried;
      if (edge.state == storage::EdgeState::kAccepted) enter_carrier(map, storage::Edge(edge));
    }
    carry_where_needed(map, to_carry, spacing, &result.seeds);
    measure_steps(map, result.accepted, !result.out_of_force.empty(), &result.seeds);
  });
  if (!result.out_of_force.empty()) forget_steps(map, unused);
  sort_unique(result.seeds);
  return result;
}

namespace {

bool already_proposed(const storage::FrameHot& query, FrameId match) {
  return std::any_of(query.edges.begin(), query.edges.end(),
                     [&](const storage::Edge& e) { return e.kind == storage::EdgeKind::kLoop && e.a == match; });
}

EdgeId store_candidate(storage::EditableGraph& map, const storage::ClosureProposalRecord& proposal) {
  storage::FrameHot& hot = map.edit_hot(proposal.query);
  storage::Edge edge;
  edge.id = {proposal.query, hot.next_loop_ordinal++};
  edge.a = proposal.match;
  edge.b = proposal.query;
  edge.kind = storage::EdgeKind::kLoop;
  edge.state = storage::EdgeState::kCandidate;
  edge.reason = Reason::LONE;
  edge.carries = false;
  edge.T_ab = edge.prior_T_ab = proposal.T_match_query;
  edge.covariance = edge.prior_covariance = proposal.covariance;
  edge.verification = proposal.verification;
  edge.inliers = proposal.inliers;
  edge.probability = proposal.probability;
  edge.spread = proposal.spread;
  edge.uniqueness = proposal.uniqueness;
  edge.around = proposal.around;
  edge.unknown = proposal.unknown;
  edge.driven_s = loop_duration(map, edge);
  hot.edges.push_back(edge);
  insert_sorted(map.edit_hot(proposal.match).incoming, edge.id);
  ++map.state().closures_candidate;
  store_bindings(map, proposal.query, edge.id, proposal.bindings);
  return edge.id;
}

void count_opponents(storage::Edge& edge, std::size_t more) {
  edge.tests.opposing = static_cast<std::uint16_t>(std::min<std::size_t>(edge.tests.opposing + more, 0xffff));
}

bool is_accepted(const storage::Graph& graph, EdgeId id) {
  return storage::find_edge(graph, id)->state == storage::EdgeState::kAccepted;
}
bool is_decided(const storage::Graph& graph, EdgeId id) { return map::is_decided(*storage::find_edge(graph, id)); }

}  // namespace

std::set<EdgeId> opponents(const storage::Graph& graph, EdgeId id, const std::vector<EdgeId>& conflicting,
                           const ConsistencyRules& rules) {
  if (!rules.coarse) return {conflicting.begin(), conflicting.end()};
  const std::vector<EdgeId> agreeing = storage::find_edge(graph, id)->consistent_with;
  std::set<EdgeId> result;
  for (const EdgeId other : conflicting) {
    const auto opponent = storage::find_edge(graph, other);
    const bool reconciled =
        std::any_of(opponent->consistent_with.begin(), opponent->consistent_with.end(), [&](EdgeId third) {
          return std::binary_search(agreeing.begin(), agreeing.end(), third) && is_accepted(graph, third);
        });
    if (!reconciled) result.insert(other);
  }
  return result;
}

void add_left_alone(const storage::Graph& graph, const std::vector<EdgeId>& winners, std::set<EdgeId>& outvoted) {
  const auto wins = [&](EdgeId id) { return std::binary_search(winners.begin(), winners.end(), id); };
  std::vector<EdgeId> broken(outvoted.begin(), outvoted.end());
  while (!broken.empty()) {
    const auto gone = storage::find_edge(graph, broken.back());
    broken.pop_back();
    for (const EdgeId id : gone->consistent_with) {
      if (!is_accepted(graph, id) || is_decided(graph, id) || wins(id) || outvoted.contains(id)) continue;
      const std::vector<EdgeId> partners = storage::find_edge(graph, id)->consistent_with;
      const bool alone = std::none_of(partners.begin(), partners.end(), [&](EdgeId partner) {
        return wins(partner) || (is_accepted(graph, partner) && !outvoted.contains(partner));
      });
      if (!alone) continue;
      outvoted.insert(id);
      broken.push_back(id);
    }
  }
}

std::optional<EdgeId> decided_among(const storage::Graph& graph, const std::set<EdgeId>& closures) {
  const auto found = std::find_if(closures.begin(), closures.end(), [&](EdgeId id) { return is_decided(graph, id); });
  return found == closures.end() ? std::nullopt : std::optional(*found);
}

namespace {

// Size of the largest consistent set of accepted closures that contains one of these.
std::size_t strength(const storage::Graph& graph, const std::set<EdgeId>& closures) {
  std::size_t max_size = 0;
  for (const EdgeId id : closures) {
    const auto edge = storage::find_edge(graph, id);
    std::vector<EdgeId> accepted = edge->consistent_with;
    std::erase_if(accepted, [&](EdgeId other) {
      return storage::find_edge(graph, other)->state != storage::EdgeState::kAccepted;
    });
    max_size = std::max(max_size, largest_consistent_set(graph, id, accepted).size());
  }
  return max_size;
}

// The change that accepts a closure with others that agree with it. If it agrees with the robot's motion only because
// the robot was carried, the closure itself says so from now on.
StateChange accepted_with_others(const storage::Graph& graph, EdgeId id, const ConsistencyRules& rules) {
  const MotionTest motion = test_motion(graph, *storage::find_edge(graph, id), rules);
  const bool carried = motion.verdict == MotionVerdict::kAsMeasured;  // of several stretches it names the newest
  return {id, storage::EdgeState::kAccepted, carried ? Reason::CARRIED : Reason::CONSISTENT,
          carried ? motion.carried.front() : storage::FrameRange{}};
}

// The closures that stand for the same ride as `id`, with `id`, ascending: those of queries near by that contradict the
// odometry and agree with `id`, directly or through others of the set.
std::vector<EdgeId> of_one_ride(const storage::Graph& graph, EdgeId id, std::uint32_t reach) {
  std::vector<EdgeId> found{id};
  std::set<EdgeId> seen{id};
  for (std::size_t i = 0; i < found.size() && found.size() < kMaxOfOneRide; ++i) {
    const auto edge = storage::find_edge(graph, found[i]);
    for (const EdgeId other : edge->consistent_with) {
      const std::uint32_t apart =
          std::max(other.frame.index, id.frame.index) - std::min(other.frame.index, id.frame.index);
      if (other.frame.session != id.frame.session || apart > reach || !seen.insert(other).second) continue;
      const auto closure = storage::find_edge(graph, other);
      // Those in force stand for another ride, with which `id` does not agree.
      if (contradicts_odometry(*closure) && closure->state != storage::EdgeState::kRemoved &&
          closure->reason != Reason::NOT_SEEN_BEYOND && closure->state != storage::EdgeState::kAccepted &&
          own_motion(*closure))
        found.push_back(other);
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

void remember_agreement(storage::EditableGraph& map, EdgeId id, const std::vector<EdgeId>& agreeing) {
  if (agreeing.empty()) return;
  for (const EdgeId other : agreeing) {
    insert_sorted(map.edit_hot(id.frame).edge(id)->consistent_with, other);
    insert_sorted(map.edit_hot(other.frame).edge(other)->consistent_with, id);
  }
}

std::uint64_t& closure_counter(storage::MapState& state, storage::EdgeState of) {
  if (of == storage::EdgeState::kAccepted) return state.closures_accepted;
  if (of == storage::EdgeState::kCandidate) return state.closures_candidate;
  return of == storage::EdgeState::kQuarantined ? state.closures_quarantined : state.closures_removed;
}

bool far_apart(const storage::Graph& graph, FrameId a, FrameId b, std::uint32_t spacing) {
  storage::LocalGraph local(graph);
  std::vector<storage::LocalStep> path;
  return !local.path(local.frame(a), local.frame(b), &path) || path.size() > spacing;
}

void add_bound(const storage::Graph& graph, const storage::Edge& closure, const std::function<bool(ClosureId)>& holds,
               std::set<LandmarkId>& known, std::set<FrameId>& frames) {
  const auto first = [](const storage::Landmark& landmark, const auto& holding) -> std::optional<LandmarkId> {
    for (const storage::AliasClaim& claim : landmark.claims)
      if (holding(claim.closure)) return claim.target;
    return std::nullopt;
  };
  for (const FrameId frame : closure.bound_frames) {
    const auto warm = graph.warm(frame);
    if (!warm) continue;
    for (const storage::Observation& observation : warm->observations) {
      if (observation.origin == closure.id) frames.insert(frame);
      if (!known.insert(observation.landmark).second) continue;
      const auto base = graph.hot(observation.landmark.base);
      if (!base) continue;
      const storage::Landmark& landmark = base->landmarks[observation.landmark.slot];
      if (first(landmark, [&](ClosureId id) { return storage::closure_holds(graph, id); }) == first(landmark, holds))
        continue;
      add_observers(graph, storage::meaning_of(graph, observation.landmark).landmark, &frames);
    }
  }
}

std::vector<EdgeId> stand_ins(const storage::Graph& graph, const std::vector<FrameId>& newer_ends) {
  std::vector<EdgeId> ids;
  const auto add = [&](const storage::Edge& edge) {
    if (edge.kind == storage::EdgeKind::kLoop && edge.state == storage::EdgeState::kAccepted && !edge.carries)
      ids.push_back(edge.id);
  };
  for (const FrameId frame : storage::frames_above(graph, newer_ends, storage::kWalkDepth)) {
    const auto hot = graph.hot(frame);
    for (const storage::Edge& edge : hot->edges) add(edge);
    for (const EdgeId incoming : hot->incoming)
      if (const auto edge = storage::find_edge(graph, incoming)) add(*edge);
  }
  return ids;
}

void carry_where_needed(storage::EditableGraph& map, const std::set<EdgeId>& closures, std::uint32_t spacing,
                        std::vector<FrameId>* seeds) {
  for (const EdgeId id : closures) {
    const storage::Edge closure = *storage::find_edge(map, id);
    if (closure.state != storage::EdgeState::kAccepted || !should_carry(map, closure, spacing)) continue;
    const float duration = loop_duration(map, closure);
    storage::Edge& edge = *map.edit_hot(id.frame).edge(id);
    edge.carries = true;
    edge.prior_active = true;  // until its support has been counted
    edge.driven_s = duration;
    seeds->push_back(edge.a);
    seeds->push_back(edge.b);
  }
}

bool taken_in_before(const storage::Graph& graph, FrameId a, FrameId b) {
  return storage::taken_in(*graph.hot(a)) < storage::taken_in(*graph.hot(b));
}

bool is_going(const storage::Graph& graph, FrameId frame) {
  const auto session = graph.session(frame.session);
  return session && storage::is_going(*session);
}

namespace {

// The changes that quarantine `outvoted` and `refused`, the latter for `reason`, and what is then left alone.
std::vector<StateChange> quarantined(const storage::Graph& graph, const std::vector<EdgeId>& winners,
                                     std::set<EdgeId> outvoted, const std::set<EdgeId>& refused, Reason reason) {
  outvoted.insert(refused.begin(), refused.end());
  add_left_alone(graph, winners, outvoted);
  std::vector<StateChange> changes;
  for (const EdgeId id : outvoted)
    changes.push_back({id, storage::EdgeState::kQuarantined, refused.contains(id) ? reason : Reason::INCONSISTENT});
  return changes;
}

// Judges one proposal: stores it as a candidate, then weighs it against the closures near by.
class Judgement {
 public:
  Judgement(storage::EditableGraph& map, std::uint64_t sequence, const storage::ClosureProposalRecord& proposal,
            std::uint32_t spacing, const ConsistencyRules& rules)
      : map_(map),
        id_(store_candidate(map, proposal)),
        cause_{sequence, id_, {}, proposal.submitted},
        spacing_(spacing),
        rules_(rules) {}

  ClosureChange run() {
    if (const storage::Edge closure = edge(); place::is_ambiguous(closure.uniqueness, closure.inliers))
      return stays_candidate(Reason::AMBIGUOUS_PLACE, id_);
    if (rules_.motion) motion_ = test_motion(map_, edge(), rules_);
    const bool contradicts = motion_.verdict == MotionVerdict::kContradicts;
    // With this reason test_consistency() compares it with closures that contradict the odometry as well.
    if (contradicts) map_.edit_hot(id_.frame).edge(id_)->reason = Reason::CONTRADICTS_MOTION;
    near_ = test_consistency(map_, edge(), rules_);
    remember_agreement(map_, id_, near_.agreeing);
    remember_tests();
    // Otherwise a wrong place that an operator has taken out would be back with the robot's next two keyframes.
    if (!near_.taken_out.empty()) return stays_candidate(Reason::REMOVED_WITH_SET, near_.taken_out.front());
    return contradicts ? judge_ride() : judge_with_odometry();
  }

 private:
  storage::Edge edge() const { return *storage::find_edge(map_, id_); }

  ClosureChange stays_candidate(Reason reason, EdgeId by) {
    set_state(*map_.edit_hot(id_.frame).edge(id_), storage::EdgeState::kCandidate, reason,
              {cause_.sequence, by, {}, cause_.submitted});
    return {};
  }

  // Stores what was found out with the closures that it is about, for those who look at them (suspicion.h).
  void remember_tests() {
    const std::set<EdgeId> opposing = opponents(map_, id_, near_.conflicting, rules_);
    for (const EdgeId other : opposing) count_opponents(*map_.edit_hot(other.frame).edge(other), 1);
    storage::Edge& edge = *map_.edit_hot(id_.frame).edge(id_);
    count_opponents(edge, opposing.size());
    if (motion_.verdict == MotionVerdict::kUntested) return;
    edge.tests.motion = motion_.verdict == MotionVerdict::kContradicts ? storage::MotionSays::kContradicts
                                                                       : storage::MotionSays::kAgrees;
    edge.tests.motion_sigma = static_cast<float>(motion_.sigma);
  }

  std::set<EdgeId> opponents_of(const storage::Graph& graph, EdgeId id) const {
    return opponents(graph, id, test_consistency(graph, *storage::find_edge(graph, id), rules_).conflicting, rules_);
  }

  // `against`, and the opponents of the other winners that are not accepted yet; without the winners themselves.
  std::set<EdgeId> outvoted_by(const storage::Graph& graph, const std::vector<EdgeId>& winners,
                               std::set<EdgeId> against) const {
    for (const EdgeId member : winners)
      if (member != id_ && !is_accepted(graph, member)) against.merge(opponents_of(graph, member));
    for (const EdgeId member : winners) against.erase(member);
    return against;
  }

  // Puts `accepted` into force and quarantines the outvoted closures and those that are taken back.
  ClosureChange change(std::vector<StateChange> accepted, const std::vector<EdgeId>& winners,
                       std::set<EdgeId> outvoted) {
    std::vector<StateChange> changes =
        quarantined(map_, winners, std::move(outvoted), taken_back_, Reason::LOOKS_ALIKE);
    changes.insert(changes.end(), accepted.begin(), accepted.end());
    return change_states(map_, changes, cause_, spacing_);
  }

  // The opponents of a ride's closures once it is known that the robot was carried along `stretch`: those before the
  // ride oppose those behind it only as long as the way between them leads along the odometry.
  std::set<EdgeId> outvoted_by_ride(const std::vector<EdgeId>& ride, const storage::FrameRange& stretch) const {
    storage::Draft with_it(map_);
    for (const EdgeId member : ride) say_carried(with_it, member, stretch);
    return outvoted_by(with_it, ride, opponents_of(with_it, id_));
  }

  // Judges a proposal that contradicts the odometry: either the robot was carried, or it is refused.
  ClosureChange judge_ride() {
    const auto refused = [&] { return stays_candidate(Reason::CONTRADICTS_MOTION, id_); };
    if (!rules_.rides || near_.agreeing.empty()) return refused();
    const std::vector<EdgeId> ride = of_one_ride(map_, id_, rules_.reach);
    const CarryingEvidence evidence = weigh_carrying(map_, ride);
    if (!evidence.speaks_for_carrying()) return refused();
    const std::set<EdgeId> outvoted = outvoted_by_ride(ride, evidence.stretch);
    const std::size_t votes = largest_consistent_set(map_, id_, near_.agreeing).size();
    if (strength(map_, outvoted) >= votes || decided_among(map_, outvoted)) return refused();
    std::vector<StateChange> accepted;
    for (const EdgeId member : ride)
      if (!is_accepted(map_, member))
        accepted.push_back({member, storage::EdgeState::kAccepted, Reason::CARRIED, evidence.stretch});
    return change(std::move(accepted), ride, outvoted);
  }

  void take_back(const SameStretch& stretch) {
    for (const EdgeId closure : stretch.closures)
      if (is_accepted(map_, closure) && !is_decided(map_, closure)) taken_back_.insert(closure);
  }

  bool looks_alike(EdgeId closure) const { return storage::find_edge(map_, closure)->reason == Reason::LOOKS_ALIKE; }

  // Judges a proposal behind a stop with all closures between the same two stretches: it may be another place that
  // looks alike. If so, refuses the proposal and takes back those of the closures that are in force. Nullopt: not
  // refused.
  std::optional<ClosureChange> refuse_look_alike() {
    if (motion_.verdict != MotionVerdict::kAgrees || edge().a.session != edge().b.session) return std::nullopt;
    look_alikes_ = weigh_look_alikes(map_, edge());
    const SameStretch& place = look_alikes_.place;
    const bool was_refused =
        std::any_of(place.closures.begin(), place.closures.end(), [&](EdgeId closure) { return looks_alike(closure); });
    bool is_other = place.is_another() || (was_refused && !place.is_the_same()), is_open = false;
    for (const SameStretch& other : look_alikes_.instead) {
      is_other = is_other || is_rather(other, place);
      is_open = is_open || !is_rather(place, other);
    }
    if (is_other || is_open) {
      if (is_other) take_back(place);
      stays_candidate(Reason::LOOKS_ALIKE, id_);
      return taken_back_.empty() ? ClosureChange() : change({}, {}, {});
    }
    for (const SameStretch& other : look_alikes_.instead) take_back(other);
    return std::nullopt;
  }

  // Adds to `set` the closures of this stretch that were refused as look-alikes and agree with a member: they come into
  // force with the first that is accepted. Refused closures of this stretch that agree with no member become lone
  // candidates. Refused closures of other stretches count for nothing.
  void add_refused_before(std::vector<EdgeId>& set) {
    const std::vector<EdgeId>& place = look_alikes_.place.closures;
    for (std::size_t i = 0; i < set.size(); ++i) {
      const auto member = storage::find_edge(map_, set[i]);
      for (const EdgeId other : member->consistent_with)
        if (std::binary_search(place.begin(), place.end(), other) && looks_alike(other) &&
            std::find(set.begin(), set.end(), other) == set.end())
          set.push_back(other);
    }
    std::sort(set.begin(), set.end());
    for (const EdgeId other : place)
      if (looks_alike(other) && !std::binary_search(set.begin(), set.end(), other))
        set_state(*map_.edit_hot(other.frame).edge(other), storage::find_edge(map_, other)->state, Reason::LONE,
                  cause_);
  }

  ClosureChange judge_with_odometry() {
    if (rules_.look_alikes)
      if (auto refused = refuse_look_alike()) return std::move(*refused);
    const std::vector<EdgeId>& place = look_alikes_.place.closures;
    std::erase_if(near_.agreeing, [&](EdgeId other) {
      return taken_back_.contains(other) ||
             (looks_alike(other) && !std::binary_search(place.begin(), place.end(), other));
    });
    std::set<EdgeId> against = opponents(map_, id_, near_.conflicting, rules_);
    // Either the closures that say that the robot was carried are wrong, or this one is.
    if (motion_.verdict == MotionVerdict::kDenies) {
      against.insert(motion_.carriers.begin(), motion_.carriers.end());
      std::erase_if(near_.agreeing, [&](EdgeId other) { return against.contains(other); });
    }
    // Votes first together with quarantined closures that agree, and, if that set does not win, without them.
    std::vector<std::vector<EdgeId>> partners{near_.agreeing, near_.agreeing};
    if (std::erase_if(partners.back(), [&](EdgeId other) {
          return storage::find_edge(map_, other)->state == storage::EdgeState::kQuarantined;
        }) == 0)
      partners.pop_back();
    for (const std::vector<EdgeId>& agreeing : partners) {
      std::vector<EdgeId> set = largest_consistent_set(map_, id_, agreeing);
      const std::set<EdgeId> outvoted = outvoted_by(map_, set, against);
      // A tie is decided against a ride, because that is the simpler explanation.
      const std::size_t votes = set.size() + (motion_.verdict == MotionVerdict::kDenies ? 1 : 0);
      if (set.size() < 2 || strength(map_, outvoted) >= votes || decided_among(map_, outvoted)) continue;
      add_refused_before(set);
      std::vector<StateChange> accepted;
      for (const EdgeId member : set)
        if (!is_accepted(map_, member)) accepted.push_back(accepted_with_others(map_, member, rules_));
      return change(std::move(accepted), set, outvoted);
    }
    if (near_.agreeing.empty() && against.empty()) {
      if (rules_.alone && motion_.verdict != MotionVerdict::kAsMeasured && is_beyond_doubt(edge()))
        return change({{id_, storage::EdgeState::kAccepted, Reason::BEYOND_DOUBT}}, {id_}, {});
      ClosureChange lone = stays_candidate(Reason::LONE, id_);
      lone.lone.push_back(id_);
      return lone;
    }
    return stays_candidate(Reason::INCONSISTENT,
                           against.empty() ? id_ : decided_among(map_, against).value_or(*against.begin()));
  }

  storage::EditableGraph& map_;
  const EdgeId id_;
  const Cause cause_;
  const std::uint32_t spacing_;
  const ConsistencyRules& rules_;
  MotionTest motion_;
  Neighbourhood near_;
  LookAlikes look_alikes_;
  std::set<EdgeId> taken_back_;  // in force so far, but of a place that looks alike
};

}  // namespace

ClosureChange apply_proposal(storage::EditableGraph& map, std::uint64_t sequence,
                             const storage::ClosureProposalRecord& proposal, std::uint32_t loop_edge_spacing,
                             const ConsistencyRules& rules) {
  const auto query = map.hot(proposal.query);
  if (!query || !map.hot(proposal.match) || proposal.query == proposal.match ||
      already_proposed(*query, proposal.match) || is_going(map, proposal.query) || is_going(map, proposal.match))
    return {};
  return Judgement(map, sequence, proposal, loop_edge_spacing, rules).run();
}

ClosureChange apply_unseen(storage::EditableGraph& map, std::uint64_t sequence, const storage::UnseenRecord& record,
                           std::uint32_t loop_edge_spacing) {
  const auto closure = storage::find_edge(map, record.closure);
  if (!closure || closure->kind != storage::EdgeKind::kLoop || closure->state != storage::EdgeState::kAccepted ||
      record.frame.session != closure->b.session || record.frame.index <= closure->b.index || !map.hot(record.frame) ||
      is_going(map, record.frame) || is_going(map, closure->a) || closure->unseen.size() >= storage::kMaxUnseen ||
      std::ranges::binary_search(closure->unseen, record.frame.index))
    return {};
  insert_sorted(map.edit_hot(closure->b).edge(closure->id)->unseen, record.frame.index);

  std::set<EdgeId> set{closure->id};
  for (const EdgeId other : closure->consistent_with)
    if (is_accepted(map, other)) set.insert(other);
  std::set<std::uint32_t> unseen;  // a frame that is looked up again may name another closure of the set
  for (const EdgeId member : set) {
    const auto edge = storage::find_edge(map, member);
    unseen.insert(edge->unseen.begin(), edge->unseen.end());
  }
  if (unseen.size() < kMinUnseen || unseen.size() <= set.size() || decided_among(map, set)) return {};
  return change_states(map, quarantined(map, {}, {}, set, Reason::NOT_SEEN_BEYOND),
                       {sequence, closure->id, {}, record.submitted}, loop_edge_spacing);
}

ClosureChange apply_binding(storage::EditableGraph& map, const storage::BindingRecord& record) {
  const auto closure = storage::find_edge(map, record.closure);
  if (!closure || closure->kind != storage::EdgeKind::kLoop || closure->state != storage::EdgeState::kAccepted ||
      !map.hot(record.frame) || is_going(map, record.frame))
    return {};
  std::set<FrameId> frames{record.frame};
  const auto warm = map.warm(record.frame);
  for (const storage::ProposedBinding& binding : record.bindings) {
    const auto index = static_cast<std::size_t>(binding.track);
    if (binding.track < 0 || index >= warm->observations.size()) continue;
    const LandmarkId own = warm->observations[index].landmark;
    if (storage::resolve(map, own) == own) add_observers(map, own, &frames);  // a first claim is in force at once
  }
  std::size_t stored = 0;
  change_support(map, frames, [&] { stored = store_bindings(map, record.frame, record.closure, record.bindings); });
  ClosureChange result;
  if (stored > 0) result.seeds = {record.frame, closure->a};
  return result;
}

}  // namespace relmap::map
