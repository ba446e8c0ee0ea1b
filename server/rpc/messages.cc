#include "server/rpc/messages.h"

#include "frontend/vision/encoded_picture.h"
#include "proto/access/principal.h"
#include "proto/wire/convert.h"
#include "server/rpc/evidence_messages.h"
#include "storage/graph/binding.h"
#include "storage/graph/frame.h"

namespace relmap::rpc {

static_assert(static_cast<int>(storage::EdgeKind::kPrior) == v1::EDGE_KIND_PRIOR);
static_assert(static_cast<int>(storage::EdgeKind::kLoop) == v1::EDGE_KIND_LOOP);
static_assert(static_cast<int>(storage::EdgeKind::kOdometry) == v1::EDGE_KIND_ODOMETRY);
static_assert(static_cast<int>(storage::EdgeState::kCandidate) == v1::EDGE_STATE_CANDIDATE);
static_assert(static_cast<int>(storage::EdgeState::kAccepted) == v1::EDGE_STATE_ACCEPTED);
static_assert(static_cast<int>(storage::EdgeState::kQuarantined) == v1::EDGE_STATE_QUARANTINED);
static_assert(static_cast<int>(storage::EdgeState::kRemoved) == v1::EDGE_STATE_REMOVED);
static_assert(static_cast<int>(MotionSource::kStart) == v1::MOTION_SOURCE_START);
static_assert(static_cast<int>(MotionSource::kVision) == v1::MOTION_SOURCE_VISION);
static_assert(static_cast<int>(MotionSource::kUnsensed) == v1::MOTION_SOURCE_UNSENSED);

v1::EdgeKind to_wire(storage::EdgeKind kind) { return static_cast<v1::EdgeKind>(kind); }
v1::EdgeState to_wire(storage::EdgeState state) { return static_cast<v1::EdgeState>(state); }
// Not a cast: the wire has values that are never stored (HOMOGRAPHY), so the numbers may differ.
v1::Verification to_wire(storage::Verification verification) {
  switch (verification) {
    case storage::Verification::kNone:
      return v1::VERIFICATION_NONE;
    case storage::Verification::kStereo:
      return v1::VERIFICATION_STEREO;
    case storage::Verification::kPnP:
      return v1::VERIFICATION_PNP;
    case storage::Verification::kEpipolar:
      return v1::VERIFICATION_EPIPOLAR;
    case storage::Verification::kImported:
      return v1::VERIFICATION_IMPORTED;
    case storage::Verification::kCompounded:
      return v1::VERIFICATION_COMPOUNDED;
  }
  return v1::VERIFICATION_NONE;
}

Result<storage::EdgeState> from_wire(v1::EdgeState state) {
  if (state == v1::EDGE_STATE_UNSPECIFIED || !v1::EdgeState_IsValid(state))
    return {Reason::INVALID_ARGUMENT, "unknown state of an edge: " + std::to_string(state)};
  return static_cast<storage::EdgeState>(state);
}

Result<storage::EdgeKind> from_wire(v1::EdgeKind kind) {
  if (kind == v1::EDGE_KIND_UNSPECIFIED || !v1::EdgeKind_IsValid(kind))
    return {Reason::INVALID_ARGUMENT, "unknown kind of an edge: " + std::to_string(kind)};
  return static_cast<storage::EdgeKind>(kind);
}

void add_count(google::protobuf::RepeatedPtrField<v1::ReasonCount>& counts, Reason reason, std::uint64_t count) {
  v1::ReasonCount& added = *counts.Add();
  added.set_reason(to_wire(reason));
  added.set_count(count);
}

namespace {

v1::Uniqueness uniqueness_message(const storage::Uniqueness& uniqueness) {
  v1::Uniqueness message;
  if (uniqueness.runner_up.valid()) *message.mutable_runner_up() = to_wire(uniqueness.runner_up);
  message.set_runner_up_inliers(uniqueness.runner_up_inliers);
  message.set_runner_up_probability(uniqueness.runner_up_probability);
  message.set_alike(uniqueness.alike);
  if (uniqueness.differs >= 0) message.set_differs(uniqueness.differs);
  message.set_compared(uniqueness.compared);
  message.set_changed(uniqueness.changed);
  return message;
}

}  // namespace

v1::Edge edge_message(const storage::Graph& graph, const storage::Edge& edge) {
  const auto hot = graph.hot(edge.b);
  return edge_message(edge, hot ? hot->time_us : 0);
}

v1::Edge edge_message(const storage::Edge& edge, std::int64_t time_us) {
  v1::Edge message;
  *message.mutable_id() = to_wire(edge.id);
  *message.mutable_a() = to_wire(edge.a);
  *message.mutable_b() = to_wire(edge.b);
  message.set_kind(to_wire(edge.kind));
  message.set_state(to_wire(edge.state));
  message.set_reason(to_wire(edge.reason));
  message.set_carries(edge.carries);
  *message.mutable_a_from_b() = to_wire(edge.T_ab);
  *message.mutable_covariance() = to_wire(edge.covariance);
  message.set_support(edge.support);
  message.set_prior_active(edge.prior_active);
  message.set_source(static_cast<v1::MotionSource>(edge.source));
  message.set_unmeasured(storage::is_unmeasured(edge));
  message.set_driven_s(edge.driven_s);
  message.set_standing_s(edge.standing_s);
  message.set_verification(to_wire(edge.verification));
  message.set_inliers(edge.inliers);
  message.set_bound(edge.bound);
  message.set_probability(edge.probability);
  message.set_spread(edge.spread);
  if (edge.uniqueness.known) *message.mutable_uniqueness() = uniqueness_message(edge.uniqueness);
  for (const EdgeId id : edge.carried_by) *message.add_carried_by() = to_wire(id);
  if (edge.carried.session != 0 && edge.state == storage::EdgeState::kAccepted) {
    *message.mutable_carried()->mutable_first() = to_wire(FrameId{edge.carried.session, edge.carried.first});
    *message.mutable_carried()->mutable_last() = to_wire(FrameId{edge.carried.session, edge.carried.last});
  }
  for (const EdgeId id : edge.consistent_with) *message.add_consistent_with() = to_wire(id);
  for (const storage::EdgeEvent& event : edge.history) {
    v1::EdgeEvent& added = *message.add_history();
    added.set_journal_sequence(event.journal_sequence);
    added.set_state(to_wire(event.state));
    added.set_reason(to_wire(event.reason));
    *added.mutable_cause() = to_wire(event.cause);
    added.set_note(event.note);
    if (event.time_us == 0) continue;
    added.set_time_us(event.time_us);
    added.set_author(author_name(event.author));
  }
  tell_suspicion(edge, message);
  message.set_time_us(time_us);
  *message.mutable_measured()->mutable_a_from_b() = to_wire(edge.prior_T_ab);
  *message.mutable_measured()->mutable_covariance() = to_wire(edge.prior_covariance);
  return message;
}

std::string author_name(const std::string& author) { return author.empty() ? access::kDaemonName : author; }

v1::Session session_message(const storage::Session& session) {
  v1::Session message;
  message.set_number(session.number);
  message.set_uuid(session.header.uuid.to_string());
  message.set_robot(session.header.robot);
  message.set_name(session.display_name);
  *message.mutable_camera() = to_wire(session.header.camera);
  if (session.header.raw) *message.mutable_raw() = to_wire(*session.header.raw);
  message.set_oneway(session.header.oneway);
  message.set_first(session.first);
  message.set_last(session.last);
  message.set_frames(session.frames);
  message.set_first_time_us(session.first_time_us);
  message.set_last_time_us(session.last_time_us);
  message.set_next_sequence(session.next_sequence);
  message.set_refused(static_cast<std::uint32_t>(session.refused));
  message.set_given_up(static_cast<std::uint32_t>(session.given_up));
  message.set_state(static_cast<v1::SessionState>(session.state));
  return message;
}

v1::CarriedStretch carried_message(const route::CarriedStretch& stretch) {
  v1::CarriedStretch message;
  *message.mutable_first() = to_wire(stretch.first);
  *message.mutable_last() = to_wire(stretch.last);
  for (const EdgeId closure : stretch.closures) *message.add_closures() = to_wire(closure);
  return message;
}

namespace {

v1::ClosureChange closure_change_message(const map::EdgeChange& change) {
  v1::ClosureChange message;
  *message.mutable_id() = to_wire(change.id);
  *message.mutable_a() = to_wire(change.a);
  *message.mutable_b() = to_wire(change.b);
  if (change.before) {
    message.set_before(to_wire(change.before->state));
    message.set_reason_before(to_wire(change.before->reason));
    message.set_edge_before(change.before->in_graph);
  }
  if (change.after) {
    message.set_after(to_wire(change.after->state));
    message.set_reason_after(to_wire(change.after->reason));
    message.set_edge_after(change.after->in_graph);
  }
  message.set_bound(change.bound);
  message.set_bound_frames(change.bound_frames);
  return message;
}

}  // namespace

v1::EditEffect effect_message(const std::vector<map::EdgeChange>& changes) {
  v1::EditEffect message;
  for (const map::EdgeChange& change : changes)
    if (change.kind == storage::EdgeKind::kLoop) *message.add_closures() = closure_change_message(change);
  const map::CarryingChanges stretches = map::carrying_changes(changes);
  for (const route::CarriedStretch& stretch : stretches.carried.list())
    *message.add_carried() = carried_message(stretch);
  for (const route::CarriedStretch& stretch : stretches.not_carried.list())
    *message.add_not_carried() = carried_message(stretch);
  return message;
}

namespace {

void add_landmarks(FrameId id, const storage::FrameHot& hot, v1::Frame& message) {
  for (std::size_t slot = 0; slot < hot.landmarks.size(); ++slot) {
    const storage::Landmark& landmark = hot.landmarks[slot];
    v1::Landmark& added = *message.add_landmarks();
    *added.mutable_id() = to_wire(LandmarkId{id, static_cast<std::uint32_t>(slot)});
    *added.mutable_point() = to_wire(landmark.point());
    added.set_observers(static_cast<std::uint32_t>(landmark.observers.size()));
  }
}

void add_observations(const storage::Graph& graph, const storage::FrameWarm& warm, v1::Frame& message) {
  for (const storage::Observation& observation : warm.observations) {
    v1::Observation& added = *message.add_observations();
    if (const LandmarkId landmark = storage::resolve(graph, observation.landmark); landmark.valid())
      *added.mutable_landmark() = to_wire(landmark);
    if (observation.origin.valid()) *added.mutable_closure() = to_wire(observation.origin);
    added.set_u_left(observation.u_left);
    added.set_v(observation.v);
    if (!is_mono(observation.pixel())) added.set_u_right(observation.u_right);
    added.set_level(observation.level);
  }
}

}  // namespace

Result<v1::Frame> frame_message(const storage::Graph& graph, FrameId id, const FrameParts& parts) {
  const auto hot = graph.hot(id);
  if (!hot || !hot->present) return {Reason::NO_SUCH_FRAME, "no frame " + id.to_string()};
  v1::Frame message;
  *message.mutable_id() = to_wire(id);
  message.set_time_us(hot->time_us);
  for (const std::string& label : hot->labels) message.add_labels(label);
  // Only what is derived (a bridge of a deletion) may be stored with another frame than its newer end.
  for (const storage::Edge& edge : hot->edges)
    *message.add_edges() = edge.b == id ? edge_message(edge, hot->time_us) : edge_message(graph, edge);
  for (const EdgeId edge : hot->incoming) *message.add_incoming() = to_wire(edge);
  *message.mutable_odometry_from_frame() = to_wire(hot->T_odom_frame);
  if (hot->mean_error >= 0) message.set_mean_error(hot->mean_error);
  message.set_landmark_count(static_cast<std::uint32_t>(hot->landmarks.size()));
  message.set_appearance_count(hot->appearance_count);
  message.set_payload_crc32c(hot->payload_crc);
  if (const auto warm = graph.warm(id)) {
    message.set_observation_count(static_cast<std::uint32_t>(warm->observations.size()));
    if (parts.observations) add_observations(graph, *warm, message);
  }
  if (parts.landmarks) add_landmarks(id, *hot, message);
  if (parts.picture) *message.mutable_picture() = picture_message(graph, id);
  if (!parts.appearance && !parts.thumbnail) return message;
  if (const auto cold = graph.cold(id)) {
    if (parts.appearance) *message.mutable_appearance() = to_wire(cold->appearance);
    if (parts.thumbnail) {
      const Bytes thumbnail = vision::thumbnail_of(cold->picture);
      message.set_thumbnail(thumbnail.data(), thumbnail.size());
    }
  }
  return message;
}

Result<FrameId> existing_frame(const storage::Graph& graph, bool given, const v1::FrameId& id, const char* what) {
  if (!given) return {Reason::INVALID_ARGUMENT, std::string(what) + " is missing"};
  auto frame = from_wire(id);
  if (!frame.ok()) return frame;
  const auto hot = graph.hot(*frame);
  if (!hot || !hot->present) return {Reason::NO_SUCH_FRAME, "no frame " + frame->to_string()};
  return frame;
}

}  // namespace relmap::rpc
