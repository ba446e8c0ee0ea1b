#include "server/map/deletion.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "server/map/carried_stretch.h"
#include "server/map/closure_states.h"
#include "server/map/sorted.h"
#include "server/map/support.h"
#include "server/map/unmeasured_steps.h"
#include "server/rba/measurement.h"
#include "storage/graph/binding.h"
#include "storage/graph/compounded_chain.h"
#include "storage/graph/local_graph.h"
#include "storage/graph/observers.h"

namespace relmap::map {

namespace {

constexpr std::size_t kSkippedAtOnce = 4096;  // records of skipped sequences that are removed by one record
constexpr double kMinDepth = 0.1;             // metres in front of a camera: nearer points are not re-based

// What a remaining frame knows of a landmark through a closure: an observation of it, or the claim of another landmark
// that it observes.
struct Fact {
  FrameId seen_in;
  std::optional<LandmarkId> claimant;  // the landmark with the claim; nullopt: an observation of seen_in
  ClosureId closure;
};

// Removes one chunk from the map.
class Deletion {
 public:
  Deletion(storage::Map& map, std::uint64_t sequence, const storage::RemoveChunkRecord& record, std::uint32_t spacing)
      : map_(map),
        sequence_(sequence),
        submitted_(record.submitted),
        session_(*map.session(record.session)),
        spacing_(spacing),
        local_(map) {
    find_frames();
    find_closures();
    find_affected();
    find_facts();
  }

  ClosureChange run() {
    const std::vector<Rebasing> rebasings = plan();
    std::set<LandmarkId> meant;  // a pass's facts about these move, whichever closure they stand by
    for (const Rebasing& rebasing : rebasings) meant.insert(rebasing.meaning);
    add_all_observers(meant);
    const std::vector<EdgeId> unused = change_support(map_, affected_, [&] {
      for (const Rebasing& rebasing : rebasings) rebase(rebasing);
      drop_facts();
      unlink();
      map_.remove_last_chunk(session_.number);
      carry_where_needed(map_, stand_ins_, spacing_, &change_.seeds);
      for (const EdgeId id : stand_ins_)
        if (storage::find_edge(map_, id)->carries) change_.stand_in.push_back(id);
      bridge();
    });
    for (const storage::Edge& edge : closures_) change_.deleted.push_back(edge.id);
    forget_steps(map_, unused);
    sort_unique(change_.seeds);
    return std::move(change_);
  }

 private:
  // A landmark of the session, and the passes of other sessions, oldest first, in which it is to be re-based.
  struct Rebasing {
    LandmarkId landmark;
    LandmarkId meaning;  // the landmark in force that it stands for now
    std::vector<std::vector<Fact>> passes;
  };

  bool goes(FrameId frame) const { return std::binary_search(going_.begin(), going_.end(), frame); }
  bool goes(ClosureId closure) const {
    const auto at = std::lower_bound(closures_.begin(), closures_.end(), closure,
                                     [](const storage::Edge& edge, ClosureId id) { return edge.id < id; });
    return at != closures_.end() && at->id == closure;
  }
  storage::TakenIn age(FrameId frame) const { return storage::taken_in(*map_.hot(frame)); }

  void find_frames();
  void find_closures();
  void find_affected();
  void find_facts();
  void add_all_observers(const std::set<LandmarkId>& landmarks);
  std::vector<Rebasing> plan() const;
  bool needs_own(const Rebasing& rebasing, const std::vector<Fact>& pass) const;
  std::vector<std::vector<Fact>> passes_of(std::vector<Fact> facts) const;
  std::optional<Vector3> seen_from(FrameId frame, LandmarkId landmark);

  void rebase(const Rebasing& rebasing);
  std::optional<LandmarkId> take_over(const Rebasing& rebasing, const std::vector<Fact>& pass);
  void link(LandmarkId landmark, const Rebasing& rebasing, const std::vector<Fact>& pass,
            const std::vector<LandmarkId>& older);
  void drop_facts();
  void let_go(ClosureId closure);
  void unlink();
  void bridge();
  // A remaining frame that an edge of the graph joins to the session.
  struct Attachment {
    FrameId frame, going;
    storage::Edge edge;
  };
  void join(const Attachment& from, FrameId to, FrameId turn, const Attachment* at_turn);
  void keep_ride(const storage::Edge& gone);
  storage::Edge add_compounded(storage::Edge edge);
  const storage::Edge* motion_into(FrameId frame) const;

  storage::Map& map_;
  const std::uint64_t sequence_;
  const storage::Submission submitted_;  // of the record
  const storage::Session session_;
  const std::uint32_t spacing_;
  storage::LocalGraph local_;  // valid until edges change

  std::vector<FrameId> going_;           // frames that go, ascending
  std::optional<FrameId> left_;          // the session's last frame afterwards
  std::vector<storage::Edge> motions_;   // odometry edges into frames that go, in the order of going_
  std::vector<storage::Edge> closures_;  // closures with an end that goes, ascending
  std::set<EdgeId> stand_ins_;           // accepted closures that may become edges in place of those that go
  std::set<FrameId> affected_;           // frames that go, and frames whose observations may change
  std::set<FrameId> near_;               // affected_, and frames that may have facts out of force about what goes
  std::map<LandmarkId, std::vector<Fact>> facts_;  // what others know of the session's landmarks
  ClosureChange change_;
};

void Deletion::find_frames() {
  const storage::ChunkId chunk = storage::chunk_id({session_.number, session_.last});
  for (std::uint32_t slot = 0; slot < storage::kFramesPerChunk; ++slot)
    if (map_.hot(storage::frame_in(chunk, slot))) going_.push_back(storage::frame_in(chunk, slot));
  for (const FrameId frame : going_)
    if (const storage::Edge* motion = map_.hot(frame)->edge({frame, 0})) motions_.push_back(*motion);
  if (!motions_.empty() && !goes(motions_.front().a)) left_ = motions_.front().a;
}

void Deletion::find_closures() {
  for (const FrameId frame : going_) {
    const auto hot = map_.hot(frame);
    for (const storage::Edge& edge : hot->edges)
      if (edge.kind == storage::EdgeKind::kLoop) closures_.push_back(edge);
    for (const EdgeId incoming : hot->incoming)
      if (const auto edge = storage::find_edge(map_, incoming);
          edge && edge->kind == storage::EdgeKind::kLoop && !goes(edge->b))
        closures_.push_back(*edge);
  }
  std::sort(closures_.begin(), closures_.end(),
            [](const storage::Edge& x, const storage::Edge& y) { return x.id < y.id; });
}

// Frames are affected beyond the ends of edges that may go or come, and as observers of landmarks that go or of the
// landmarks that these stand for.
void Deletion::find_affected() {
  std::vector<FrameId> ends = going_;
  if (left_) ends.push_back(*left_);
  for (const storage::Edge& edge : closures_)
    if (edge.in_graph()) ends.insert(ends.end(), {edge.a, edge.b});
  for (const EdgeId id : stand_ins(map_, ends))
    if (!goes(id)) stand_ins_.insert(id);
  for (const EdgeId id : stand_ins_) ends.push_back(id.frame);
  affected_.insert(going_.begin(), going_.end());
  add_frames_beyond(map_, ends, &affected_);

  std::set<LandmarkId> known;
  const auto holds_after = [&](ClosureId id) { return !goes(id) && storage::closure_holds(map_, id); };
  for (const storage::Edge& edge : closures_) add_bound(map_, edge, holds_after, known, affected_);
  std::set<LandmarkId> meant;
  for (const FrameId frame : going_) {
    const auto slots = static_cast<std::uint32_t>(map_.hot(frame)->landmarks.size());
    for (std::uint32_t slot = 0; slot < slots; ++slot) meant.insert(storage::meaning_of(map_, {frame, slot}).landmark);
  }
  add_all_observers(meant);
}

// Adds the observers of those of the landmarks that stay.
void Deletion::add_all_observers(const std::set<LandmarkId>& landmarks) {
  std::optional<FrameId> all_near;  // the base of which all frames in reach have been added
  for (const LandmarkId landmark : landmarks) {
    if (!landmark.valid() || goes(landmark.base)) continue;
    const bool fixed = storage::is_fixed(map_.hot(landmark.base)->landmarks[landmark.slot].observers);
    if (fixed && all_near == landmark.base) continue;
    add_observers(map_, landmark, &affected_);
    if (fixed) all_near = landmark.base;
  }
}

// Facts in force are those of the observers (affected_); facts out of force are in frames where closures near by bind.
void Deletion::find_facts() {
  std::set<FrameId> around(going_.begin(), going_.end());
  std::vector<std::int32_t> walk;
  for (const FrameId frame : going_) local_.nearest(local_.frame(frame), storage::kWalkFrames, &walk);
  for (const std::int32_t frame : walk) around.insert(local_.frames[static_cast<std::size_t>(frame)].id);
  for (const FrameId frame : storage::frames_above(map_, going_, storage::kWalkDepth)) around.insert(frame);

  near_ = affected_;
  near_.insert(around.begin(), around.end());
  std::set<EdgeId> seen;
  const auto note_bound = [&](const storage::Edge& edge) {
    if (edge.kind != storage::EdgeKind::kLoop || !seen.insert(edge.id).second) return;
    near_.insert(edge.bound_frames.begin(), edge.bound_frames.end());
  };
  for (const FrameId frame : around) {
    const auto hot = map_.hot(frame);
    for (const storage::Edge& edge : hot->edges) note_bound(edge);
    for (const EdgeId incoming : hot->incoming)
      if (const auto edge = storage::find_edge(map_, incoming)) note_bound(*edge);
  }
  std::erase_if(near_, [&](FrameId frame) { return !map_.hot(frame); });

  for (const FrameId frame : near_) {
    if (frame.session == session_.number) continue;
    const auto warm = map_.warm(frame);
    for (const storage::Observation& z : warm->observations) {
      if (z.landmark.base.session == session_.number) {
        facts_[z.landmark].push_back({frame, std::nullopt, z.origin});
        continue;
      }
      const auto base = map_.hot(z.landmark.base);
      if (!base || z.landmark.slot >= base->landmarks.size()) continue;
      for (const storage::AliasClaim& claim : base->landmarks[z.landmark.slot].claims)
        if (claim.target.valid() && claim.target.base.session == session_.number)
          facts_[claim.target].push_back({frame, z.landmark, claim.closure});
    }
  }
}

std::vector<Deletion::Rebasing> Deletion::plan() const {
  std::vector<Rebasing> rebasings;
  for (const auto& [landmark, facts] : facts_) {
    const LandmarkId meaning = storage::meaning_of(map_, landmark).landmark;
    Rebasing rebasing{landmark, meaning, passes_of(facts)};
    std::erase_if(rebasing.passes, [&](const std::vector<Fact>& pass) { return !needs_own(rebasing, pass); });
    if (!rebasing.passes.empty()) rebasings.push_back(std::move(rebasing));
  }
  return rebasings;
}

// Whether the pass has a fact in force about the landmark that is lost with the landmark's base or with a closure.
bool Deletion::needs_own(const Rebasing& rebasing, const std::vector<Fact>& pass) const {
  return std::any_of(pass.begin(), pass.end(), [&](const Fact& fact) {
    return storage::closure_holds(map_, fact.closure) && (goes(rebasing.landmark.base) || goes(fact.closure)) &&
           (!fact.claimant || storage::meaning_of(map_, *fact.claimant).landmark == rebasing.meaning);
  });
}

// Groups facts by pass, the oldest pass first.
std::vector<std::vector<Fact>> Deletion::passes_of(std::vector<Fact> facts) const {
  std::stable_sort(facts.begin(), facts.end(), [](const Fact& x, const Fact& y) { return x.seen_in < y.seen_in; });
  std::vector<std::vector<Fact>> passes;
  for (const Fact& fact : facts) {
    if (passes.empty() || !storage::in_one_pass(passes.back().back().seen_in, fact.seen_in)) passes.emplace_back();
    passes.back().push_back(fact);
  }
  std::sort(passes.begin(), passes.end(),
            [&](const auto& x, const auto& y) { return age(x.front().seen_in) < age(y.front().seen_in); });
  return passes;
}

// The landmark's parameters (a, b, rho) in a frame; nullopt if no path leads there or it is not in front of the camera.
std::optional<Vector3> Deletion::seen_from(FrameId frame, LandmarkId landmark) {
  std::vector<storage::LocalStep> steps;
  if (!landmark.valid() || !local_.path(local_.frame(landmark.base), local_.frame(frame), &steps)) return std::nullopt;
  SE3 T_base_frame;
  for (const storage::LocalStep& step : steps) {
    const SE3& T_ab = local_.edges[static_cast<std::size_t>(step.edge)].record->T_ab;
    T_base_frame = T_base_frame * (step.forward ? T_ab : T_ab.inverse());
  }
  const Vector3 point = T_base_frame.inverse() * map_.hot(landmark.base)->landmarks[landmark.slot].point();
  if (point.z() < kMinDepth) return std::nullopt;
  return Vector3(point.x() / point.z(), point.y() / point.z(), std::max(1 / point.z(), rba::kMinInverseDepth));
}

void Deletion::rebase(const Rebasing& rebasing) {
  std::vector<LandmarkId> older;  // landmarks of the passes before
  for (const std::vector<Fact>& pass : rebasing.passes) {
    if (!needs_own(rebasing, pass)) continue;  // an earlier re-basing may have done it
    const auto landmark = take_over(rebasing, pass);
    if (!landmark) continue;
    map_.state().pending.insert(landmark->base);
    link(*landmark, rebasing, pass, older);
    older.push_back(*landmark);
  }
}

// The landmark of the pass that takes the re-based one's place; nullopt if there is none and none can be made.
std::optional<LandmarkId> Deletion::take_over(const Rebasing& rebasing, const std::vector<Fact>& pass) {
  std::optional<LandmarkId> own;
  for (const Fact& fact : pass)
    if (fact.claimant && storage::meaning_of(map_, *fact.claimant).landmark == rebasing.meaning &&
        (!own || age(fact.claimant->base) < age(own->base)))
      own = fact.claimant;
  const FrameId base = own ? own->base : pass.front().seen_in;
  const auto estimate = seen_from(base, rebasing.meaning);
  if (own) {
    if (estimate) map_.edit_hot(base).landmarks[own->slot].abr = *estimate;
    return own;
  }
  if (!estimate) return std::nullopt;
  storage::FrameHot& hot = map_.edit_hot(base);
  const auto slot = static_cast<std::uint32_t>(hot.landmarks.size());
  storage::Landmark landmark;
  landmark.abr = *estimate;
  landmark.depth_prior = map_.hot(rebasing.meaning.base)->landmarks[rebasing.meaning.slot].depth_prior;
  hot.landmarks.push_back(std::move(landmark));
  return LandmarkId{base, slot};
}

// Makes all that the pass has of the landmark mean `own` from now on. If a closure in force that stays joins the pass
// to an older one, `own` claims to be the older pass's landmark by that closure.
void Deletion::link(LandmarkId own, const Rebasing& rebasing, const std::vector<Fact>& pass,
                    const std::vector<LandmarkId>& older) {
  ClosureId to_older;
  std::set<LandmarkId> linked;
  for (const Fact& fact : pass) {
    if (fact.closure.valid() && !goes(fact.closure) && storage::closure_holds(map_, fact.closure) && !to_older.valid())
      to_older = fact.closure;
    if (!fact.claimant) {
      for (storage::Observation& z : map_.edit_warm(fact.seen_in).observations)
        if (z.landmark == rebasing.landmark && storage::closure_holds(map_, z.origin)) {
          let_go(z.origin);
          z.landmark = own;
          z.origin = storage::kFromDeletedSession;
        }
      continue;
    }
    if (!linked.insert(*fact.claimant).second) continue;
    const bool older_than = *fact.claimant != own && age(own.base) < age(fact.claimant->base);
    std::vector<storage::AliasClaim> claims;
    bool claimed = !older_than;
    const auto base = map_.hot(fact.claimant->base);
    for (const storage::AliasClaim& claim : base->landmarks[fact.claimant->slot].claims) {
      if (claim.target != rebasing.landmark || !storage::closure_holds(map_, claim.closure)) {
        claims.push_back(claim);
        continue;
      }
      let_go(claim.closure);
      if (!std::exchange(claimed, true)) claims.push_back({own, storage::kFromDeletedSession});
    }
    map_.edit_hot(fact.claimant->base).landmarks[fact.claimant->slot].claims = std::move(claims);
  }
  if (!to_older.valid()) return;
  const storage::Edge closure = *storage::find_edge(map_, to_older);
  const auto other = std::find_if(older.rbegin(), older.rend(), [&](LandmarkId landmark) {
    return (landmark.base.session == closure.a.session || landmark.base.session == closure.b.session) &&
           age(landmark.base) < age(own.base);
  });
  if (other == older.rend()) return;
  const auto sees_own = std::find_if(pass.begin(), pass.end(), [&](const Fact& fact) {
    return fact.claimant ? *fact.claimant == own : storage::closure_holds(map_, fact.closure);
  });
  if (sees_own == pass.end()) return;
  map_.edit_hot(own.base).landmarks[own.slot].claims.push_back({*other, to_older});
  storage::Edge& edge = *map_.edit_hot(to_older.frame).edge(to_older);
  insert_sorted(edge.bound_frames, sees_own->seen_in);
  edge.bound = static_cast<std::uint16_t>(std::min(edge.bound + 1, 0xffff));
}

// Notes that a claim or an observation of this closure has gone.
void Deletion::let_go(ClosureId closure) {
  if (!closure.valid() || goes(closure)) return;
  if (const auto edge = storage::find_edge(map_, closure); edge && edge->bound > 0)
    --map_.edit_hot(closure.frame).edge(closure)->bound;
}

// Drops the remaining facts that stand by closures that go, or are about landmarks that go.
void Deletion::drop_facts() {
  std::set<LandmarkId> known;
  for (const FrameId frame : near_) {
    if (goes(frame)) continue;
    const auto is_void = [&](const storage::Observation& z) { return goes(z.landmark.base) || goes(z.origin); };
    const auto warm = map_.warm(frame);
    for (const storage::Observation& z : warm->observations) {
      if (is_void(z) || !known.insert(z.landmark).second) continue;
      const auto base = map_.hot(z.landmark.base);
      if (!base || z.landmark.slot >= base->landmarks.size()) continue;
      const auto drop = [&](const storage::AliasClaim& claim) {
        return goes(claim.closure) || goes(claim.target.base);
      };
      const auto& claims = base->landmarks[z.landmark.slot].claims;
      if (std::none_of(claims.begin(), claims.end(), drop)) continue;
      // If nothing else claims it, the landmark is in force by itself now, with the estimate of the one it stood for.
      const LandmarkId meant = storage::meaning_of(map_, z.landmark).landmark;
      const auto estimate = meant == z.landmark ? std::nullopt : seen_from(z.landmark.base, meant);
      storage::Landmark& landmark = map_.edit_hot(z.landmark.base).landmarks[z.landmark.slot];
      for (const storage::AliasClaim& claim : landmark.claims)
        if (drop(claim)) let_go(claim.closure);
      std::erase_if(landmark.claims, drop);
      if (estimate && storage::meaning_of(map_, z.landmark).landmark == z.landmark) landmark.abr = *estimate;
    }
    if (std::none_of(warm->observations.begin(), warm->observations.end(), is_void)) continue;
    storage::FrameWarm& edited = map_.edit_warm(frame);
    for (const storage::Observation& z : edited.observations)
      if (is_void(z)) let_go(z.origin);
    std::erase_if(edited.observations, is_void);
  }
}

// Removes edges to frames that go from the frames that stay.
void Deletion::unlink() {
  local_.clear();
  storage::MapState& state = map_.state();
  state.keyframes -= going_.size();
  for (const storage::Edge& edge : closures_) {
    if (edge.state == storage::EdgeState::kAccepted && edge.b.session != session_.number &&
        edge.verification != storage::Verification::kCompounded) {
      change_.gone.push_back(edge);
      change_.gone.back().state = storage::EdgeState::kRemoved;
      change_.gone.back().reason = Reason::SESSION_DELETED;
    }
    --closure_counter(state, edge.state);
    if (edge.state == storage::EdgeState::kAccepted) take_out_carrier(map_, edge);
    for (const EdgeId other : edge.consistent_with)
      if (!goes(other))
        if (auto hot = map_.hot(other.frame); hot && hot->edge(other))
          std::erase(map_.edit_hot(other.frame).edge(other)->consistent_with, edge.id);
    if (!goes(edge.b))
      std::erase_if(map_.edit_hot(edge.b).edges, [&](const storage::Edge& e) { return e.id == edge.id; });
    if (!goes(edge.a) && map_.hot(edge.a)) std::erase(map_.edit_hot(edge.a).incoming, edge.id);
    if (!goes(edge.b) && edge.state == storage::EdgeState::kAccepted && edge.carried.session == edge.b.session &&
        edge.around)
      keep_ride(edge);
  }
  if (left_) std::erase(map_.edit_hot(*left_).incoming, motions_.front().id);
  // Closures between other frames that bind in frames that go.
  std::map<EdgeId, std::set<FrameId>> bound;
  for (const FrameId frame : going_) {
    const auto warm = map_.warm(frame);
    for (const storage::Observation& z : warm->observations) {
      if (z.origin.valid()) {
        let_go(z.origin);
        bound[z.origin].insert(frame);
      }
      const auto base = map_.hot(z.landmark.base);
      if (!base || z.landmark.slot >= base->landmarks.size()) continue;
      for (const storage::AliasClaim& claim : base->landmarks[z.landmark.slot].claims)
        if (claim.closure.valid()) bound[claim.closure].insert(frame);
    }
    const auto hot = map_.hot(frame);
    for (const storage::Landmark& landmark : hot->landmarks)
      for (const storage::AliasClaim& claim : landmark.claims) let_go(claim.closure);
  }
  for (const auto& [closure, bound_frames] : bound) {
    const std::set<FrameId>& frames = bound_frames;
    const auto edge = goes(closure) ? std::nullopt : storage::find_edge(map_, closure);
    if (!edge) continue;
    std::erase_if(map_.edit_hot(closure.frame).edge(closure)->bound_frames,
                  [&](FrameId frame) { return frames.contains(frame); });
  }
}

// The odometry edge that ends in a frame that goes.
const storage::Edge* Deletion::motion_into(FrameId frame) const {
  const auto at =
      std::find_if(motions_.begin(), motions_.end(), [&](const storage::Edge& edge) { return edge.b == frame; });
  return at == motions_.end() ? nullptr : &*at;
}

// Bridges the session stretch by stretch, from its end. In each stretch the frames that it joined are joined to the
// oldest of them, so that walks up stay short however many passes there are. The oldest frame is joined to the oldest
// of the next stretch, and the last of these to the end of what is left of the session.
void Deletion::bridge() {
  std::vector<Attachment> attachments;
  for (const storage::Edge& edge : closures_) {
    const FrameId going = goes(edge.b) ? edge.b : edge.a;
    const FrameId frame = edge.other(going);
    if (edge.in_graph() && frame.session != session_.number) attachments.push_back({frame, going, edge});
    change_.seeds.push_back(frame);
  }
  std::erase_if(change_.seeds, [&](FrameId frame) { return !map_.hot(frame); });
  std::stable_sort(attachments.begin(), attachments.end(),
                   [](const Attachment& x, const Attachment& y) { return y.going < x.going; });
  const Attachment* before = nullptr;  // the oldest attachment of the previous stretch
  for (auto begin = attachments.begin(); begin != attachments.end();) {
    const auto end = std::find_if(begin, attachments.end(), [&](const Attachment& attachment) {
      return begin->going.index - attachment.going.index >= spacing_;
    });
    const auto oldest = std::min_element(
        begin, end, [&](const Attachment& x, const Attachment& y) { return age(x.frame) < age(y.frame); });
    if (before) join(*before, oldest->frame, oldest->going, &*oldest);
    for (auto at = begin; at != end; ++at)
      if (at < oldest)
        join(*at, oldest->frame, oldest->going, &*oldest);
      else if (at > oldest)
        join(*oldest, at->frame, at->going, &*at);
    before = &*oldest;
    begin = end;
  }
  if (before && left_) join(*before, *left_, *left_, nullptr);
}

// Adds a bridge from the frame of `from` to `to` if the remaining path is much longer. The bridge compounds the edge of
// `from`, the robot's motion back to `turn`, and the edge of `at_turn`; a null `at_turn` means that `to` is `turn`.
void Deletion::join(const Attachment& from, FrameId to, FrameId turn, const Attachment* at_turn) {
  if (to == from.frame) return;
  storage::CompoundedChain chain;
  std::uint32_t edges = 0;
  double driven_s = 0, standing_s = 0;
  const auto walk = [&](const storage::Edge& edge, bool forward) {
    chain.append(edge, forward);
    ++edges;
    driven_s += static_cast<double>(edge.driven_s);
    standing_s += static_cast<double>(edge.standing_s);
  };
  walk(from.edge, from.edge.a == from.frame);
  for (FrameId at = from.going; at != turn;) {
    const storage::Edge* motion = motion_into(at);
    if (!motion) return;
    walk(*motion, false);
    at = motion->a;
  }
  if (at_turn) walk(at_turn->edge, at_turn->edge.b == to);
  if (!far_apart(map_, from.frame, to, edges + spacing_)) return;

  const bool to_is_newer = age(to) > age(from.frame);
  storage::Edge edge;
  edge.a = to_is_newer ? from.frame : to;
  edge.b = to_is_newer ? to : from.frame;
  edge.prior_active = true;
  const SE3 T = to_is_newer ? chain.T() : chain.T().inverse();
  edge.T_ab = edge.prior_T_ab = T.normalized();
  edge.covariance = edge.prior_covariance =
      to_is_newer ? chain.covariance() : inverse_covariance(chain.T(), chain.covariance());
  edge.driven_s = static_cast<float>(driven_s);
  edge.standing_s = static_cast<float>(standing_s);
  add_compounded(std::move(edge));
  change_.seeds.push_back(to);
}

// That the robot was carried stays known if a closure with a frame that goes showed it by the way around: as a closure
// with the robot's own past, which is no edge of the graph.
void Deletion::keep_ride(const storage::Edge& gone) {
  storage::Edge edge;
  edge.a = gone.around->from;
  edge.b = gone.b;
  const auto hot = map_.hot(edge.b);
  const bool known = std::any_of(hot->edges.begin(), hot->edges.end(), [&](const storage::Edge& other) {
    return other.a == edge.a && other.verification == storage::Verification::kCompounded && other.carried.session != 0;
  });
  if (known || !map_.hot(edge.a)) return;
  edge.carries = false;
  edge.T_ab = edge.prior_T_ab = gone.around->T;
  edge.covariance = edge.prior_covariance = gone.around->covariance;
  edge.carried = gone.carried;
  edge = add_compounded(std::move(edge));
  enter_carrier(map_, edge);
  // They go on voting for the ride together.
  const EdgeId first_step{{edge.carried.session, edge.carried.first + 1}, 0};
  std::vector<EdgeId> others;
  if (const auto step = storage::find_edge(map_, first_step))
    for (const EdgeId id : step->carried_by)
      if (const auto other = storage::find_edge(map_, id);
          id != edge.id && other && other->verification == storage::Verification::kCompounded)
        others.push_back(id);
  remember_agreement(map_, edge.id, others);
}

// Stores a closure that replaces what was known through frames that go. Returns it with its id.
storage::Edge Deletion::add_compounded(storage::Edge edge) {
  edge.kind = storage::EdgeKind::kLoop;
  edge.reason = Reason::SESSION_DELETED;
  edge.verification = storage::Verification::kCompounded;
  storage::FrameHot& hot = map_.edit_hot(edge.b);
  edge.id = {edge.b, hot.next_loop_ordinal++};
  edge.history.push_back({sequence_,
                          storage::EdgeState::kAccepted,
                          Reason::SESSION_DELETED,
                          edge.id,
                          {},
                          submitted_.time_us,
                          submitted_.author});
  hot.edges.push_back(edge);
  insert_sorted(map_.edit_hot(edge.a).incoming, edge.id);
  ++map_.state().closures_accepted;
  change_.stand_in.push_back(edge.id);
  return edge;
}

}  // namespace

std::optional<storage::RemoveChunkRecord> next_deletion(const storage::Session& session) {
  if (!storage::is_going(session) || (session.frames == 0 && session.refused == 0 && session.given_up == 0))
    return std::nullopt;
  return storage::RemoveChunkRecord{
      session.number, storage::chunk_of({session.number, session.last}), {}, {0, session.deleted_by}};
}

ClosureChange apply_deletion(storage::Map& map, std::uint64_t sequence, const storage::RemoveChunkRecord& record,
                             std::uint32_t loop_edge_spacing) {
  const auto session = map.session(record.session);
  const auto next = session ? next_deletion(*session) : std::nullopt;
  if (!next || next->chunk != record.chunk) return {};
  if (session->frames == 0) {
    map.forget_skipped(record.session, kSkippedAtOnce);
    return {};
  }
  return Deletion(map, sequence, record, loop_edge_spacing).run();
}

}  // namespace relmap::map
