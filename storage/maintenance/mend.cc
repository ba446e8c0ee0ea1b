#include "storage/maintenance/mend.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "storage/graph/precision.h"
#include "storage/maintenance/frame_check.h"
#include "storage/maintenance/references.h"

namespace relmap::storage {
namespace {

// Standard deviations of 10 m and 1 rad: hardly any information, but a prior that keeps the solution unique.
const Matrix6 kUnknownStep = Vector6(100, 100, 100, 1, 1, 1).asDiagonal();
constexpr double kFarAway = 0.1;  // inverse depth of a landmark of which nothing is known, per metre

template <typename Check, typename Part>
bool sound(Check check, FrameId id, const Part& part) {
  bool complained = false;
  check(id, part, [&](const std::string&) { complained = true; });
  return !complained;
}

class Mender {
 public:
  Mender(Map& map, std::size_t dirty_bytes, RepairSummary& summary, const OnFinding& told,
         const OnProgress& on_progress)
      : map_(map), dirty_bytes_(dirty_bytes), summary_(summary), told_(told), on_progress_(on_progress) {}

  void run() {
    for (const Session& session : map_.sessions()) {
      std::optional<FrameId> before;
      for (std::uint64_t index = session.first; session.frames > 0 && index <= session.last; ++index) {
        const FrameId id{session.number, static_cast<std::uint32_t>(index)};
        if (!map_.hot(id)) {
          index = skip_absent(id);
          continue;
        }
        if (session.header.camera.is_stereo()) mend_motion(id, before);
        mend_hot(id);
        mend_warm(id);
        count_closures(id);
        before = id;
        if (++done_ % kFramesPerChunk == 0) breathe();
      }
    }
    mend_state();
  }

 private:
  void tell(Reason reason, FrameId frame, const std::string& what) {
    summary_.changed = true;
    if (told_) told_({reason, frame, "frame " + frame.to_string() + ": " + what, true});
  }
  void breathe() {
    if (on_progress_ && !on_progress_({"references", done_, map_.state().keyframes, "frames"}))
      throw StatusError(Status(Reason::SHUTTING_DOWN, "the repair was stopped; it can be run again"));
    if (map_.dirty_bytes() > dirty_bytes_)
      if (Status committed = map_.commit(); !committed.ok()) throw StatusError(committed);
  }
  // The last index of the skipped range that contains `id`, so that a gap of millions costs one step.
  std::uint64_t skip_absent(FrameId id) const {
    std::uint64_t last = id.index;
    map_.visit_skipped(id.session, id.index, [&](const Skipped& skipped) {
      if (skipped.from <= id.index) last = skipped.to;
      return false;
    });
    return last;
  }
  bool exists(LandmarkId id) const {
    const auto hot = map_.hot(id.base);
    return hot && id.slot < hot->landmarks.size();
  }
  bool older(FrameId frame, FrameId than) const { return taken_in(*map_.hot(frame)) < taken_in(*map_.hot(than)); }
  const Edge* closure(EdgeId id) const {
    const auto hot = map_.hot(id.frame);
    const Edge* edge = hot ? hot->edge(id) : nullptr;
    return edge && edge->kind == EdgeKind::kLoop ? edge : nullptr;
  }

  // Each frame of a session has an odometry edge to the one before; the first has none. (In a mono session no frame has
  // one.)
  void mend_motion(FrameId id, std::optional<FrameId> before) {
    const auto hot = map_.hot(id);
    const Edge* motion = hot->edge({id, 0});
    if (!before) {
      if (!motion) return;
      tell(Reason::DATA_LOSS, id, "all frames before it are lost; it begins its session now");
      auto& edges = map_.edit_hot(id).edges;
      std::erase_if(edges, [](const Edge& edge) { return edge.id.ordinal == 0; });
      return;
    }
    if (motion && motion->a == *before) {
      // Its stored correlation is with the step that is lost, not with the bridge in that step's place.
      const auto from = map_.hot(*before);
      const Edge* step_before = from->edge({*before, 0});
      if (step_before && step_before->reason == Reason::DATA_LOSS && !is_zero(motion->correlation_with_previous))
        map_.edit_hot(id).edge({id, 0})->correlation_with_previous = {};
      return;
    }
    const Edge bridge = bridge_to(id, *before, motion);
    tell(Reason::DATA_LOSS, id, "bridged to " + before->to_string() + " by the robot's odometry");
    ++summary_.bridges;
    auto& edges = map_.edit_hot(id).edges;
    std::erase_if(edges, [](const Edge& edge) { return edge.id.ordinal == 0; });
    edges.insert(edges.begin(), bridge);
  }
  // The bridge keeps the id of the edge that it replaces: it is still "how the robot came here from the frame before".
  Edge bridge_to(FrameId id, FrameId before, const Edge* lost) const {
    const auto from = map_.hot(before), to = map_.hot(id);
    Edge edge;
    edge.id = {id, 0};
    edge.a = before;
    edge.b = id;
    edge.kind = EdgeKind::kPrior;
    edge.reason = Reason::DATA_LOSS;
    edge.source = lost ? lost->source : MotionSource::kUnsensed;
    edge.T_ab = edge.prior_T_ab = (from->T_odom_frame.inverse() * to->T_odom_frame).normalized();
    edge.covariance = edge.prior_covariance = kUnknownStep;
    if (lost && lost->a.session == id.session && lost->a.index < id.index)
      edge.covariance = edge.prior_covariance = lost->prior_covariance * static_cast<double>(id.index - before.index) /
                                                static_cast<double>(id.index - lost->a.index);
    edge.prior_active = true;
    edge.standing_s = lost ? lost->standing_s : 0;
    edge.driven_s =
        std::max(0.0f, static_cast<float>(static_cast<double>(to->time_us - from->time_us) * 1e-6) - edge.standing_s);
    return edge;
  }

  void mend_hot(FrameId id) {
    const auto hot = map_.hot(id);
    FrameHot mended = *hot;
    mend_numbers(id, mended);
    for (Edge& edge : mended.edges) mend_edge(id, edge);
    for (Landmark& landmark : mended.landmarks) {
      const std::size_t dropped = std::erase_if(landmark.claims, [&](const AliasClaim& claim) {
        return (claim.closure.valid() && !closure(claim.closure)) ||
               (claim.target.valid() && (!exists(claim.target) || !older(claim.target.base, id)));
      });
      summary_.dropped_claims += dropped;
      if (dropped > 0) changed_ = true;
    }
    if (!std::exchange(changed_, false)) return;
    tell(Reason::CORRUPT, id, "its edges and landmarks were mended");
    map_.edit_hot(id) = std::move(mended);
  }
  void mend_edge(FrameId id, Edge& edge) {
    if (edge.kind == EdgeKind::kLoop && !map_.hot(edge.a) &&
        !(edge.state == EdgeState::kQuarantined && edge.reason == Reason::DATA_LOSS)) {
      edge.state = EdgeState::kQuarantined;
      edge.reason = Reason::DATA_LOSS;
      edge.carries = false;
      ++summary_.quarantined_edges;
      changed_ = true;
      tell(Reason::DATA_LOSS, id,
           "closure " + edge.id.to_string() + " to " + edge.a.to_string() + " is quarantined: that frame is lost");
    }
    changed_ = std::erase_if(edge.bound_frames, [&](FrameId frame) { return !map_.hot(frame); }) > 0 || changed_;
    changed_ = std::erase_if(edge.consistent_with, [&](EdgeId other) { return !closure(other); }) > 0 || changed_;
    if (edge.in_graph() && edge.prior_active != needs_prior(edge, edge.support)) {
      edge.prior_active = needs_prior(edge, edge.support);
      ++summary_.rebuilt;
      changed_ = true;
    }
  }

  // Mends what no checksum shows: numbers and orders that only a bug of ours or an edit by hand can have made.
  void mend_numbers(FrameId id, FrameHot& frame) {
    if (sound(check_hot, id, frame)) return;
    changed_ = true;
    if (!is_transform(frame.T_odom_frame)) frame.T_odom_frame = near_rotation(frame.T_odom_frame);
    if (!std::isfinite(frame.mean_error)) frame.mean_error = -1;
    std::sort(frame.edges.begin(), frame.edges.end(), [](const Edge& l, const Edge& r) { return l.id < r.id; });
    for (Edge& edge : frame.edges) {
      if (!is_transform(edge.prior_T_ab)) edge.prior_T_ab = near_rotation(edge.prior_T_ab);
      if (!is_transform(edge.T_ab)) edge.T_ab = is_finite(edge.T_ab) ? near_rotation(edge.T_ab) : edge.prior_T_ab;
      if (!is_covariance(edge.prior_covariance)) edge.prior_covariance = kUnknownStep;
      if (!is_covariance(edge.covariance)) {
        edge.covariance = edge.prior_covariance;
        edge.correlation_with_previous = {};
      }
      if (edge.around && (!is_transform(edge.around->T) || !is_covariance(edge.around->covariance) ||
                          edge.around->from.session != id.session))
        edge.around.reset();
      for (float* number : {&edge.driven_s, &edge.standing_s, &edge.probability, &edge.spread})
        if (!std::isfinite(*number)) *number = 0;
      std::sort(edge.bound_frames.begin(), edge.bound_frames.end());
      std::sort(edge.consistent_with.begin(), edge.consistent_with.end());
      if (edge.id.ordinal >= frame.next_loop_ordinal)
        frame.next_loop_ordinal = static_cast<std::uint16_t>(edge.id.ordinal + 1);
    }
    // An edge that is not even this frame's cannot be mended.
    summary_.quarantined_edges += std::erase_if(frame.edges, [&](const Edge& edge) {
      return edge.id.frame != id || edge.b != id || edge.a == edge.b || !edge.a.valid() ||
             (edge.id.ordinal == 0) != (edge.kind != EdgeKind::kLoop);
    });
    frame.edges.erase(
        std::unique(frame.edges.begin(), frame.edges.end(), [](const Edge& l, const Edge& r) { return l.id == r.id; }),
        frame.edges.end());
    for (Landmark& landmark : frame.landmarks) {
      if (!landmark.abr.allFinite()) landmark.abr = {0, 0, kFarAway};
      landmark.abr.z() = std::max(landmark.abr.z(), kMinInverseDepth);
    }
  }

  void mend_warm(FrameId id) {
    const auto warm = map_.warm(id);
    const auto bad = [&](const Observation& z) {
      return !exists(z.landmark) || (z.origin.valid() && !closure(z.origin)) || !is_finite(z);
    };
    const auto dropped =
        static_cast<std::size_t>(std::count_if(warm->observations.begin(), warm->observations.end(), bad));
    if (dropped > 0) {
      summary_.dropped_observations += dropped;
      tell(Reason::DATA_LOSS, id, std::to_string(dropped) + " observations of what is lost were dropped");
      std::erase_if(map_.edit_warm(id).observations, bad);
    }
    const auto mended = map_.warm(id);
    for (const Observation& z : mended->observations) {
      if (!z.origin.valid()) continue;
      const auto& bound = closure(z.origin)->bound_frames;
      if (std::binary_search(bound.begin(), bound.end(), id)) continue;
      auto& edited = map_.edit_hot(z.origin.frame).edge(z.origin)->bound_frames;
      edited.insert(std::lower_bound(edited.begin(), edited.end(), id), id);
      tell(Reason::CORRUPT, id, "closure " + z.origin.to_string() + " binds in it");
    }
  }

  void count_closures(FrameId id) {
    const auto hot = map_.hot(id);
    for (const Edge& edge : hot->edges)
      if (edge.kind == EdgeKind::kLoop) ++closures_[static_cast<std::size_t>(edge.state) - 1];
  }
  void mend_state() {
    MapState& state = map_.state();
    const auto gone = [&](FrameId frame) { return !map_.hot(frame); };
    std::size_t mended = std::erase_if(state.lookups, gone);
    const auto pending = state.pending.chunks();
    for (const auto& [chunk, frames] : pending)
      for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
        if (((frames >> slot) & 1) && gone(frame_in(chunk, slot))) state.pending.erase(frame_in(chunk, slot)), ++mended;
    std::uint64_t* const counters[] = {&state.closures_candidate, &state.closures_accepted, &state.closures_quarantined,
                                       &state.closures_removed};
    for (std::size_t i = 0; i < closures_.size(); ++i) {
      mended += *counters[i] != closures_[i];
      *counters[i] = closures_[i];
    }
    if (mended == 0) return;
    summary_.changed = true;
    if (told_) told_({Reason::CORRUPT, {}, "the map's state: frames that wait, and counters", true});
  }

  Map& map_;
  const std::size_t dirty_bytes_;
  RepairSummary& summary_;
  const OnFinding& told_;
  const OnProgress& on_progress_;
  std::uint64_t done_ = 0;
  bool changed_ = false;  // the frame at hand has been changed
  std::array<std::uint64_t, 4> closures_{};
};

}  // namespace

void mend_references(Map& map, std::size_t dirty_bytes, RepairSummary& summary, const OnFinding& told,
                     const OnProgress& on_progress) {
  Mender(map, dirty_bytes, summary, told, on_progress).run();
}

}  // namespace relmap::storage
