#include "client/replies.h"

#include <algorithm>

#include "client/enum_reply.h"
#include "proto/wire/convert.h"
#include "relmap/v1/admin.pb.h"
#include "relmap/v1/map.pb.h"

namespace relmap::client {

namespace {

Status ill_formed(const char* what, const Status& why) {
  return {Reason::CORRUPT, std::string("the daemon's ") + what + " is ill formed: " + why.message()};
}

// The covariance may be absent. Its plausibility is not checked.
Matrix6 read_covariance(const v1::Covariance& message) {
  UpperTriangle values;
  if (message.upper_size() != static_cast<int>(values.size())) return Matrix6::Identity();
  std::copy(message.upper().begin(), message.upper().end(), values.begin());
  return from_upper_triangle(values);
}

}  // namespace

FrameId read_id(const v1::FrameId& id) { return {id.session(), id.index()}; }
EdgeId read_id(const v1::EdgeId& id) { return {read_id(id.frame()), id.ordinal()}; }

v1::View view_message(const View& view) {
  v1::View message;
  if (view.frame) {
    *message.mutable_frame() = to_wire(*view.frame);
    return message;
  }
  if (view.features.empty())
    message.mutable_left()->set_data(view.left);
  else
    *message.mutable_features() = to_wire(view.features);
  if (!view.right.empty()) message.mutable_right()->set_data(view.right);
  if (const auto* camera = std::get_if<StereoCamera>(&view.camera)) *message.mutable_camera() = to_wire(*camera);
  if (const auto* raw = std::get_if<StereoCalibration>(&view.camera)) *message.mutable_raw() = to_wire(*raw);
  if (const auto* session = std::get_if<SessionNumber>(&view.camera)) message.set_session(*session);
  message.set_rectified(view.rectified);
  message.set_supposed(view.supposed);
  message.set_either_eye(view.either_eye);
  return message;
}

v1::RouteEnd route_end_message(const RouteEnd& end) {
  v1::RouteEnd message;
  if (const auto* frame = std::get_if<FrameId>(&end)) *message.mutable_frame() = to_wire(*frame);
  if (const auto* label = std::get_if<std::string>(&end)) message.set_label(*label);
  if (const auto* view = std::get_if<View>(&end)) *message.mutable_view() = view_message(*view);
  if (const auto* robot = std::get_if<Robot>(&end)) message.set_robot(robot->name);
  return message;
}

v1::FindRouteRequest route_message(const RouteRequest& asked) {
  v1::FindRouteRequest request;
  *request.mutable_from() = route_end_message(asked.from);
  *request.mutable_to() = route_end_message(asked.to);
  for (const RouteEnd& end : asked.or_from) *request.add_or_from() = route_end_message(end);
  for (const RouteEnd& end : asked.or_to) *request.add_or_to() = route_end_message(end);
  if (asked.weights) {
    v1::RouteWeights& weights = *request.mutable_weights();
    weights.set_metre(asked.weights->metre);
    weights.set_driven_second(asked.weights->driven_second);
    weights.set_standing_second(asked.weights->standing_second);
    weights.set_square_metre_of_variance(asked.weights->square_metre_of_variance);
  } else {
    request.set_by(static_cast<v1::RouteBy>(asked.by));
    request.set_count_standing(asked.count_standing);
  }
  request.set_max_cost(asked.max_cost);
  v1::RouteFilter& filter = *request.mutable_filter();
  for (const SessionNumber number : asked.filter.sessions) filter.add_sessions(number);
  for (const FrameId frame : asked.filter.avoid_frames) *filter.add_avoid_frames() = to_wire(frame);
  for (const std::string& label : asked.filter.avoid_labels) filter.add_avoid_labels(label);
  filter.set_min_support(asked.filter.min_support);
  filter.set_no_long_loops(!asked.filter.long_loops);
  filter.set_suppose_candidates(asked.filter.suppose_candidates);
  filter.set_suppose_quarantined(asked.filter.suppose_quarantined);
  request.set_covariance(asked.covariance);
  request.set_alternatives(asked.alternatives);
  return request;
}

v1::ListEdgesRequest edges_message(const EdgeFilter& filter) {
  constexpr std::size_t kMaxPage = 5000;
  v1::ListEdgesRequest request;
  for (const EdgeState state : filter.states) request.add_states(static_cast<v1::EdgeState>(state));
  for (const EdgeKind kind : filter.kinds) request.add_kinds(static_cast<v1::EdgeKind>(kind));
  request.set_session(filter.session);
  if (filter.frame) *request.mutable_frame() = to_wire(*filter.frame);
  request.set_other_session(filter.other_session);
  request.set_from_us(filter.from_us);
  request.set_until_us(filter.until_us);
  request.set_min_suspicion(filter.min_suspicion);
  if (filter.region) {
    *request.mutable_region()->mutable_root() = to_wire(filter.region->root);
    request.mutable_region()->set_max_edges(filter.region->max_edges);
    request.mutable_region()->set_max_metres(filter.region->max_metres);
  }
  if (filter.order != EdgeOrder::kId) request.set_order(static_cast<v1::EdgeOrder>(filter.order));
  if (filter.limit > 0) request.set_page_size(static_cast<std::uint32_t>(std::min(filter.limit, kMaxPage)));
  return request;
}

namespace {

CarriedStretch read_carried(const v1::CarriedStretch& message) {
  CarriedStretch stretch{read_id(message.first()), read_id(message.last()), {}};
  for (const v1::EdgeId& id : message.closures()) stretch.closures.push_back(read_id(id));
  return stretch;
}

// `message`: a RouteSummary or a TransformBetweenReply.
template <typename Way>
Unmeasured read_unmeasured(const Way& message) {
  Unmeasured unmeasured{.steps = message.unmeasured_steps(), .distance_m = message.unmeasured_m()};
  for (const v1::UnmeasuredStretch& stretch : message.unmeasured())
    unmeasured.stretches.push_back(
        {read_id(stretch.first()), read_id(stretch.last()), stretch.steps(), stretch.distance_m()});
  return unmeasured;
}

Suspicion read_suspicion(const v1::Suspicion& message) {
  Suspicion suspicion{message.value(), {}, message.remark()};
  for (const v1::Doubt& doubt : message.doubts()) {
    Doubt read{{}, doubt.weight(), doubt.message()};
    // Doubts decide nothing: one of a kind that only a newer daemon knows is left out.
    if (read_enum(doubt.kind(), read.kind).ok()) suspicion.doubts.push_back(std::move(read));
  }
  return suspicion;
}

FramePicture read_picture(const v1::FramePicture& message) {
  FramePicture picture{message.data(), message.width(), message.height(), message.scale(), {}};
  if (!(picture.scale > 0)) picture.scale = 1;
  if (message.reason() != v1::REASON_OK || message.data().empty())
    picture.missing = {message.reason() == v1::REASON_OK ? Reason::UNSUPPORTED : reason_from_wire(message.reason()),
                       message.message().empty() ? "the map keeps no picture of it" : message.message()};
  return picture;
}

template <typename Messages>
std::vector<Correspondence> read_correspondences(const Messages& messages) {
  std::vector<Correspondence> points;
  for (const v1::Correspondence& message : messages) {
    Correspondence& point = points.emplace_back();
    point.in_view = {message.u(), message.v()};
    point.in_frame = {message.frame_u(), message.frame_v()};
    point.inlier = message.inlier();
    if (message.has_residual()) point.residual = message.residual();
    if (message.has_seen_in()) point.seen_in = read_id(message.seen_in());
  }
  return points;
}

}  // namespace

Result<Edge> read_edge(const v1::Edge& message) {
  const auto T = from_wire(message.a_from_b());
  if (!T.ok()) return ill_formed("edge", T.status());
  Edge edge;
  edge.id = read_id(message.id());
  edge.a = read_id(message.a());
  edge.b = read_id(message.b());
  for (const Status& read :
       {read_enum(message.kind(), edge.kind), read_enum(message.state(), edge.state),
        read_enum(message.source(), edge.source), read_enum(message.verification(), edge.verification)})
    if (!read.ok()) return read;
  edge.reason = reason_from_wire(message.reason());
  edge.carries = message.carries();
  edge.T_ab = *T;
  edge.covariance = read_covariance(message.covariance());
  edge.support = message.support();
  edge.prior_active = message.prior_active();
  edge.unmeasured = message.unmeasured();
  edge.driven_s = message.driven_s();
  edge.standing_s = message.standing_s();
  edge.inliers = message.inliers();
  edge.bound = message.bound();
  edge.probability = message.probability();
  edge.spread = message.spread();
  for (const v1::EdgeId& id : message.consistent_with()) edge.consistent_with.push_back(read_id(id));
  for (const v1::EdgeEvent& event : message.history()) {
    edge.history.push_back({event.journal_sequence(),
                            {},
                            reason_from_wire(event.reason()),
                            read_id(event.cause()),
                            event.note(),
                            event.time_us(),
                            event.author()});
    if (Status read = read_enum(event.state(), edge.history.back().state); !read.ok()) return read;
  }
  for (const v1::EdgeId& id : message.carried_by()) edge.carried_by.push_back(read_id(id));
  if (message.has_carried()) edge.carried = read_carried(message.carried());
  if (message.has_suspicion()) edge.suspicion = read_suspicion(message.suspicion());
  edge.time_us = message.time_us();
  if (message.has_measured()) {
    const auto measured = from_wire(message.measured().a_from_b());
    if (!measured.ok()) return ill_formed("edge", measured.status());
    edge.measured = {*measured, read_covariance(message.measured().covariance())};
  }
  if (!message.has_uniqueness()) return edge;
  const v1::Uniqueness& found = message.uniqueness();
  Uniqueness& uniqueness = edge.uniqueness.emplace();
  if (found.has_runner_up()) uniqueness.runner_up = read_id(found.runner_up());
  uniqueness.runner_up_inliers = found.runner_up_inliers();
  uniqueness.runner_up_probability = found.runner_up_probability();
  uniqueness.alike = found.alike();
  if (found.has_differs()) uniqueness.differs = found.differs();
  uniqueness.compared = found.compared();
  uniqueness.changed = found.changed();
  return edge;
}

namespace {

Result<MotionVerdict> read_verdict(const v1::MotionVerdict& message) {
  const auto T = from_wire(message.a_from_b());
  // Without a way between the ends there is no transform.
  if (!T.ok() && message.has_a_from_b()) return ill_formed("verdict", T.status());
  MotionVerdict verdict;
  verdict.verdict = reason_from_wire(message.verdict());
  verdict.message = message.message();
  verdict.edges = message.edges();
  verdict.distance_m = message.distance_m();
  if (T.ok()) verdict.T_ab = *T;
  verdict.covariance = read_covariance(message.covariance());
  verdict.metres_apart = message.metres_apart();
  verdict.radians_apart = message.radians_apart();
  verdict.sigmas_apart = message.sigmas_apart();
  return verdict;
}

}  // namespace

Result<EdgeExplanation> read_explanation(const v1::ExplainEdgeReply& message) {
  EdgeExplanation explained;
  auto edge = read_edge(message.edge());
  if (!edge.ok()) return edge.status();
  explained.edge = std::move(edge).value();
  if (message.has_picture_a()) explained.picture_a = read_picture(message.picture_a());
  if (message.has_picture_b()) explained.picture_b = read_picture(message.picture_b());
  if (message.has_runner_up()) explained.runner_up = read_picture(message.runner_up());
  explained.correspondences = read_correspondences(message.correspondences());
  if (message.correspondences_reason() != v1::REASON_OK)
    explained.correspondences_missing = {reason_from_wire(message.correspondences_reason()),
                                         message.correspondences_message()};
  if (message.has_motion()) {
    auto verdict = read_verdict(message.motion());
    if (!verdict.ok()) return verdict.status();
    explained.motion = std::move(verdict).value();
  }
  for (const v1::Agreement& agreement : message.agreements()) {
    explained.agreements.push_back(
        {read_id(agreement.edge()), read_id(agreement.a()), read_id(agreement.b()), {}, agreement.agrees()});
    if (Status read = read_enum(agreement.state(), explained.agreements.back().state); !read.ok()) return read;
  }
  return explained;
}

ClosureMatrixCell read_cell(const v1::ClosureMatrixCell& message) {
  ClosureMatrixCell cell{message.session_a(),
                         message.session_b(),
                         message.candidate(),
                         message.accepted(),
                         message.quarantined(),
                         message.removed(),
                         {},
                         message.suspicion()};
  if (message.has_most_suspicious()) cell.most_suspicious = read_id(message.most_suspicious());
  return cell;
}

AuditEntry read_audit(const v1::AuditEntry& message) {
  AuditEntry entry{message.time_us(), message.who(),     message.role(),       message.from(),
                   message.method(),  message.request(), message.request_id(), {},
                   message.seconds(), message.trace_id()};
  if (message.outcome() != v1::REASON_OK) entry.outcome = {reason_from_wire(message.outcome()), message.message()};
  return entry;
}

Result<EditEffect> read_effect(const v1::EditEffect& message) {
  // Unspecified: the closure did not, or does not, exist.
  const auto read_state = [](v1::EdgeState wire, std::optional<EdgeState>& state) {
    return wire == v1::EDGE_STATE_UNSPECIFIED ? Status() : read_enum(wire, state.emplace());
  };
  EditEffect effect;
  for (const v1::ClosureChange& change : message.closures()) {
    effect.closures.push_back({read_id(change.id()), read_id(change.a()), read_id(change.b()), std::nullopt,
                               std::nullopt, reason_from_wire(change.reason_before()),
                               reason_from_wire(change.reason_after()), change.edge_before(), change.edge_after(),
                               change.bound(), change.bound_frames()});
    ClosureChange& read = effect.closures.back();
    if (Status known = read_state(change.before(), read.before); !known.ok()) return known;
    if (Status known = read_state(change.after(), read.after); !known.ok()) return known;
  }
  for (const v1::CarriedStretch& stretch : message.carried()) effect.carried.push_back(read_carried(stretch));
  for (const v1::CarriedStretch& stretch : message.not_carried()) effect.not_carried.push_back(read_carried(stretch));
  return effect;
}

Result<ExportedFrame> read_exported(const v1::ExportedFrame& message) {
  if (message.landmarks_size() != 3 * message.observers_size())
    return ill_formed("frame", {Reason::BAD_SIZE, std::to_string(message.landmarks_size()) + " coordinates of " +
                                                      std::to_string(message.observers_size()) + " landmarks"});
  ExportedFrame frame{read_id(message.id()), message.time_us(), {}};
  for (int i = 0; i < message.observers_size(); ++i)
    frame.landmarks.push_back(
        {{message.landmarks(3 * i), message.landmarks(3 * i + 1), message.landmarks(3 * i + 2)}, message.observers(i)});
  return frame;
}

Result<Frame> read_frame(const v1::Frame& message) {
  const auto T = from_wire(message.odometry_from_frame());
  if (!T.ok()) return ill_formed("frame", T.status());
  Frame frame;
  frame.id = read_id(message.id());
  frame.time_us = message.time_us();
  frame.labels.assign(message.labels().begin(), message.labels().end());
  for (const v1::Edge& e : message.edges()) {
    auto edge = read_edge(e);
    if (!edge.ok()) return edge.status();
    frame.edges.push_back(std::move(edge).value());
  }
  for (const v1::EdgeId& id : message.incoming()) frame.incoming.push_back(read_id(id));
  frame.T_odom_frame = *T;
  if (message.has_mean_error()) frame.mean_error = message.mean_error();
  frame.landmarks = message.landmark_count();
  frame.observations = message.observation_count();
  frame.appearance = message.appearance_count();
  frame.thumbnail = message.thumbnail();
  if (message.has_picture()) frame.picture = read_picture(message.picture());
  return frame;
}

Result<Session> read_session(const v1::Session& message) {
  const auto camera = from_wire(message.camera());
  if (!camera.ok()) return ill_formed("session", camera.status());
  Session session;
  session.number = message.number();
  session.uuid = message.uuid();
  session.robot = message.robot();
  session.name = message.name();
  session.camera = *camera;
  if (message.has_raw()) {
    auto raw = from_wire(message.raw());
    if (!raw.ok()) return ill_formed("session", raw.status());
    session.raw = std::move(*raw);
  }
  session.oneway = message.oneway();
  session.first = message.first();
  session.last = message.last();
  session.frames = message.frames();
  session.first_time_us = message.first_time_us();
  session.last_time_us = message.last_time_us();
  session.refused = message.refused();
  session.given_up = message.given_up();
  session.next_sequence = message.next_sequence();
  if (Status read = read_enum(message.state(), session.state); !read.ok()) return read;
  return session;
}

Result<Localisation> read_localisation(const v1::LocaliseReply& message) {
  const auto T = from_wire(message.frame_from_view());
  if (!T.ok()) return ill_formed("localisation", T.status());
  Localisation found;
  found.frame = read_id(message.frame());
  found.T_frame_view = *T;
  found.covariance = read_covariance(message.covariance());
  found.inliers = message.inliers();
  if (Status read = read_enum(message.verification(), found.verification); !read.ok()) return read;
  found.probability = message.probability();
  found.spread = message.spread();
  found.new_place = message.new_place();
  found.near_prior = message.near_prior();
  if (message.estimated_focal_length() > 0) found.estimated_focal_length = message.estimated_focal_length();
  found.correspondences = read_correspondences(message.correspondences());
  return found;
}

Result<PlaceMatches> read_matches(const v1::MatchImageReply& message) {
  PlaceMatches matches;
  matches.new_place = message.new_place();
  matches.nothing_verified = {reason_from_wire(message.reason()), message.message()};
  for (const v1::PlaceMatch& place : message.places()) {
    PlaceMatch& match = matches.places.emplace_back();
    match.frame = read_id(place.frame());
    match.probability = place.probability();
    if (Status read = read_enum(place.verification(), match.verification); !read.ok()) return read;
    match.inliers = place.inliers();
    match.spread = place.spread();
    match.unverified = {reason_from_wire(place.reason()), place.message()};
    match.thumbnail = place.thumbnail();
    match.correspondences = read_correspondences(place.correspondences());
    if (place.estimated_focal_length() > 0) match.estimated_focal_length = place.estimated_focal_length();
    if (!place.has_frame_from_view()) continue;
    const auto T = from_wire(place.frame_from_view());
    if (!T.ok()) return ill_formed("match", T.status());
    match.T_frame_view = *T;
    match.covariance = read_covariance(place.covariance());
  }
  return matches;
}

namespace {

Status read_route_summary(const v1::RouteSummary& message, Route& route) {
  route.from = read_id(message.from());
  route.to = read_id(message.to());
  route.cost = message.cost();
  route.distance_m = message.distance_m();
  route.time_s = message.time_s();
  route.long_loops = message.long_loops();
  for (const v1::CarriedStretch& stretch : message.carried()) route.carried.push_back(read_carried(stretch));
  route.unmeasured = read_unmeasured(message);
  route.frame_by_frame = message.frame_by_frame();
  route.bound_closures = message.bound_closures();
  route.no_way_by_edges = message.no_way_by_edges();
  route.shared = message.shared();
  if (message.has_from_view()) {
    auto found = read_localisation(message.from_view());
    if (!found.ok()) return found.status();
    route.from_view = std::move(found).value();
  }
  if (message.has_to_view()) {
    auto found = read_localisation(message.to_view());
    if (!found.ok()) return found.status();
    route.to_view = std::move(found).value();
  }
  return {};
}

Result<RouteStep> read_route_step(const v1::RouteStep& message) {
  RouteStep step;
  step.frame = read_id(message.frame());
  step.distance_m = message.distance_m();
  step.time_s = message.time_s();
  step.labels.assign(message.labels().begin(), message.labels().end());
  if (message.has_covariance()) {
    const auto T_start_this = from_wire(message.start_from_this());
    if (!T_start_this.ok()) return ill_formed("route", T_start_this.status());
    step.T_start_this = *T_start_this;
    step.covariance = read_covariance(message.covariance());
  }
  if (!message.has_edge()) return step;
  const auto T = from_wire(message.to_next());
  if (!T.ok()) return ill_formed("route", T.status());
  step.edge = read_id(message.edge());
  if (Status read = read_enum(message.kind(), step.kind); !read.ok()) return read;
  step.T_to_next = *T;
  step.long_loop = message.long_loop();
  step.carried = message.carried();
  step.unmeasured = message.unmeasured();
  return step;
}

}  // namespace

Status read_route_reply(const v1::FindRouteReply& message, Route& route) {
  const std::size_t others = route.alternatives.size();
  if (message.route() > others + 1)
    return ill_formed("route", {Reason::BAD_SIZE, "alternative " + std::to_string(message.route()) + " follows " +
                                                      std::to_string(others) + " others"});
  if (message.route() == others + 1) route.alternatives.emplace_back();
  Route& part = message.route() == 0 ? route : route.alternatives[message.route() - 1];
  if (message.has_summary())
    if (Status status = read_route_summary(message.summary(), part); !status.ok()) return status;
  for (const v1::RouteStep& step : message.steps()) {
    auto read = read_route_step(step);
    if (!read.ok()) return read.status();
    part.steps.push_back(std::move(read).value());
  }
  return {};
}

Result<Neighbourhood> read_neighbourhood(const v1::GetNeighbourhoodReply& message) {
  Neighbourhood found;
  for (const v1::NeighbourhoodFrame& frame : message.frames()) {
    const auto T = from_wire(frame.root_from_frame());
    if (!T.ok()) return ill_formed("neighbourhood", T.status());
    found.frames.push_back({read_id(frame.frame()), *T, frame.distance_m(), frame.time_us()});
  }
  for (const v1::Edge& e : message.edges()) {
    auto edge = read_edge(e);
    if (!edge.ok()) return edge.status();
    found.edges.push_back(std::move(edge).value());
  }
  found.cut = message.cut();
  return found;
}

Result<TransformBetween> read_transform(const v1::TransformBetweenReply& message) {
  const auto T = from_wire(message.a_from_b());
  if (!T.ok()) return ill_formed("transform", T.status());
  TransformBetween found{*T, read_covariance(message.covariance()), message.edges(), message.distance_m(),
                         message.compounded()};
  for (const v1::CarriedStretch& stretch : message.carried()) found.carried.push_back(read_carried(stretch));
  found.unmeasured = read_unmeasured(message);
  return found;
}

}  // namespace relmap::client
