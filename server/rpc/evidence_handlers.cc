// What a loop closure is believed for: ExplainEdge.
#include <algorithm>
#include <set>

#include "proto/wire/convert.h"
#include "server/map/closure_states.h"
#include "server/map/lookup.h"
#include "server/map/other_way.h"
#include "server/place/verify.h"
#include "server/rpc/charge.h"
#include "server/rpc/evidence_messages.h"
#include "server/rpc/handlers.h"
#include "server/rpc/messages.h"

namespace relmap::rpc {

namespace {

constexpr int kMaxAgreements = 256;

struct Matched {
  Status why_none;  // ok if geometry confirms the closure today, too
  std::vector<place::PointMatch> matches;
  std::shared_ptr<const storage::FrameCold> query;  // owns the features of the newer end
};

// Why there can be no correspondences between what the frames keep; ok if there can.
Status check_comparable(const storage::Graph& graph, const storage::Edge& closure) {
  if (closure.verification == storage::Verification::kImported)
    return {Reason::UNSUPPORTED, "the closure was imported: no pictures were compared for it"};
  if (closure.verification == storage::Verification::kCompounded)
    return {Reason::UNSUPPORTED, "the closure replaces a way through a deleted session: no pictures were compared"};
  for (const FrameId end : {closure.a, closure.b}) {
    const auto cold = graph.cold(end);
    if (!cold || cold->appearance.empty())
      return {Reason::UNSUPPORTED, "the map keeps no features of " + end.to_string()};
  }
  return {};
}

// All frames of the session but this one: geometry then tells the matches in its pixels.
std::vector<storage::FrameRange> all_but(FrameId frame) {
  std::vector<storage::FrameRange> masked;
  if (frame.index > 0) masked.push_back({frame.session, 0, frame.index - 1});
  masked.push_back({frame.session, frame.index + 1, std::numeric_limits<std::uint32_t>::max()});
  return masked;
}

place::PlaceTrial try_at(const storage::Graph& graph, const storage::FrameCold& seen, FrameId frame, FrameId at,
                         std::span<const storage::FrameRange> masked) {
  place::QueryPicture query = place::query_of(seen, graph.session(frame.session)->header.camera);
  query.masked = masked;
  query.keep_matches = true;
  return map::try_frame(graph, query, frame, at);
}

// A closure may have been found from the older end. Its matches as those of the newer one: what was measured in both.
std::vector<place::PointMatch> turned_round(const std::vector<place::PointMatch>& matches,
                                            const storage::FrameCold& older, const storage::FrameCold& newer) {
  std::vector<place::PointMatch> turned;
  for (const place::PointMatch& match : matches) {
    if (match.seen_in.valid()) continue;
    const auto measured = std::ranges::find_if(newer.appearance, [&](const AppearanceFeature& feature) {
      return feature.u == match.pixel.x() && feature.v == match.pixel.y();
    });
    if (measured == newer.appearance.end()) continue;
    const AppearanceFeature& seen = older.appearance[match.feature];
    turned.push_back({static_cast<std::uint32_t>(measured - newer.appearance.begin()),
                      {seen.u, seen.v},
                      {},
                      match.inlier,
                      std::nullopt});
  }
  return turned;
}

Matched match_again(const storage::Graph& graph, const storage::Edge& closure, const Deadline& deadline) {
  Matched matched;
  if (matched.why_none = check_comparable(graph, closure); !matched.why_none.ok()) return matched;
  matched.query = graph.cold(closure.b);
  const auto others = all_but(closure.a);
  place::PlaceTrial trial = try_at(graph, *matched.query, closure.b, closure.a, others);
  matched.matches = std::move(trial.matches);
  if (trial.verified.ok() || !storage::is_metric(closure.verification)) {
    matched.why_none = trial.verified.status();
    return matched;
  }
  if (Status late = deadline.check(); !late.ok()) throw StatusError(late);
  const auto older = graph.cold(closure.a);
  const auto others_of_b = all_but(closure.b);
  const place::PlaceTrial reverse = try_at(graph, *older, closure.a, closure.b, others_of_b);
  if (!reverse.verified.ok())
    matched.why_none = trial.verified.status();
  else
    matched.matches = turned_round(reverse.matches, *older, *matched.query);
  return matched;
}

v1::MotionVerdict verdict_message(const map::OtherWay& other) {
  v1::MotionVerdict message;
  message.set_verdict(to_wire(other.verdict));
  message.set_message(other.message);
  if (!other.way) return message;
  message.set_edges(other.way->edges);
  message.set_distance_m(other.way->distance_m);
  *message.mutable_a_from_b() = to_wire(other.way->T_ab);
  *message.mutable_covariance() = to_wire(other.way->covariance);
  message.set_metres_apart(other.metres_apart);
  message.set_radians_apart(other.radians_apart);
  message.set_sigmas_apart(other.sigmas_apart);
  return message;
}

void add_agreement(const storage::Graph& graph, EdgeId id, bool agrees, v1::ExplainEdgeReply& reply) {
  if (reply.agreements_size() == kMaxAgreements) return;
  const auto edge = storage::find_edge(graph, id);
  if (!edge) return;
  v1::Agreement& added = *reply.add_agreements();
  *added.mutable_edge() = to_wire(edge->id);
  *added.mutable_a() = to_wire(edge->a);
  *added.mutable_b() = to_wire(edge->b);
  added.set_state(to_wire(edge->state));
  added.set_agrees(agrees);
}

// Those that contradict come first: they are few, and tell more.
void add_agreements(const storage::Graph& graph, const storage::Edge& closure, v1::ExplainEdgeReply& reply) {
  if (storage::is_metric(closure.verification) && closure.verification != storage::Verification::kCompounded)
    for (const EdgeId other : map::opponents(graph, closure.id, map::test_consistency(graph, closure).conflicting))
      add_agreement(graph, other, false, reply);
  for (const EdgeId other : closure.consistent_with) add_agreement(graph, other, true, reply);
}

}  // namespace

Result<v1::ExplainEdgeReply> explain_edge(const v1::ExplainEdgeRequest& request, const Deadline& deadline,
                                          map::Mapper& mapper, const RpcLimits& limits) {
  if (!request.has_edge()) return {Reason::INVALID_ARGUMENT, "edge is missing"};
  const auto id = from_wire(request.edge());
  if (!id.ok()) return id.status();
  const auto view = mapper.view();
  const auto edge = storage::find_edge(*view, *id);
  if (!edge) return {Reason::NO_SUCH_EDGE, "no edge " + id->to_string()};
  if (edge->kind != storage::EdgeKind::kLoop)
    return {Reason::ODOMETRY_EDGE, id->to_string() +
                                       " is an edge of the robot's own motion: only loop closures have "
                                       "evidence"};
  v1::ExplainEdgeReply reply;
  *reply.mutable_edge() = edge_message(*view, *edge);
  if (request.pictures()) {
    *reply.mutable_picture_a() = picture_message(*view, edge->a);
    *reply.mutable_picture_b() = picture_message(*view, edge->b);
    if (edge->uniqueness.runner_up.valid())
      *reply.mutable_runner_up() = picture_message(*view, edge->uniqueness.runner_up);
  }
  const Matched matched = match_again(*view, *edge, deadline);
  reply.set_correspondences_reason(to_wire(matched.why_none.reason()));
  reply.set_correspondences_message(matched.why_none.message());
  if (matched.query)
    add_correspondences(matched.matches, matched.query->appearance, {}, *reply.mutable_correspondences());
  if (Status late = deadline.check(); !late.ok()) return late;

  SearchWork work(mapper.budget(), limits.max_search_frames, deadline);
  const auto other = map::other_way(*view, *edge, work.limit());
  if (!other.ok()) return other.status();
  *reply.mutable_motion() = verdict_message(*other);
  if (Status late = deadline.check(); !late.ok()) return late;
  add_agreements(*view, *edge, reply);
  reply.set_map_version(view->version());
  return reply;
}

}  // namespace relmap::rpc
