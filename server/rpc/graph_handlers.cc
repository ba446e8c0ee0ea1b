#include <cmath>

#include "proto/wire/convert.h"
#include "server/route/neighbourhood.h"
#include "server/route/transform.h"
#include "server/rpc/charge.h"
#include "server/rpc/handlers.h"
#include "server/rpc/messages.h"

namespace relmap::rpc {

namespace {

constexpr std::uint32_t kDefaultDepth = 30;
constexpr std::uint32_t kDefaultNeighbours = 1000;
constexpr std::uint32_t kMaxNeighbours = 10000;
// The default limit of gRPC's clients is 4 MB.
constexpr std::size_t kMaxReplyBytes = 3u << 20;
constexpr std::size_t kBytesPerLandmark = 32;

}  // namespace

Result<v1::TransformBetweenReply> transform_between(const v1::TransformBetweenRequest& request,
                                                    const Deadline& deadline, map::Mapper& mapper,
                                                    const RpcLimits& limits) {
  const auto view = mapper.view();
  const auto a = existing_frame(*view, request.has_a(), request.a(), "a");
  if (!a.ok()) return a.status();
  const auto b = existing_frame(*view, request.has_b(), request.b(), "b");
  if (!b.ok()) return b.status();
  SearchWork work(mapper.budget(), limits.max_search_frames, deadline);
  const auto found = route::transform_between(*view, *a, *b, work.limit());
  if (!found.ok()) return found.status();
  v1::TransformBetweenReply reply;
  *reply.mutable_a_from_b() = to_wire(found->T_ab);
  *reply.mutable_covariance() = to_wire(found->covariance);
  reply.set_compounded(found->compounded);
  reply.set_edges(found->edges);
  reply.set_distance_m(found->distance_m);
  for (const route::CarriedStretch& stretch : found->carried.list()) *reply.add_carried() = carried_message(stretch);
  tell_unmeasured(found->unmeasured, reply);
  reply.set_map_version(view->version());
  return reply;
}

Result<v1::GetNeighbourhoodReply> get_neighbourhood(const v1::GetNeighbourhoodRequest& request,
                                                    const Deadline& deadline, map::Mapper& mapper,
                                                    const RpcLimits& limits) {
  const auto view = mapper.view();
  const auto root = existing_frame(*view, request.has_root(), request.root(), "root");
  if (!root.ok()) return root.status();
  if (!std::isfinite(request.max_metres()) || request.max_metres() < 0)
    return {Reason::INVALID_ARGUMENT, "max_metres must be 0 (no limit) or more"};

  route::NeighbourhoodLimits within;
  within.edges = request.max_edges() == 0 ? kDefaultDepth : request.max_edges();
  if (request.max_metres() > 0) within.metres = request.max_metres();
  const std::uint64_t max_frames =
      request.max_frames() == 0 ? kDefaultNeighbours : std::min(kMaxNeighbours, request.max_frames());
  SearchWork work(mapper.budget(), std::min(limits.max_search_frames, max_frames), deadline);
  const auto found = route::neighbourhood(*view, *root, within, work.limit());
  if (!found.ok()) return found.status();

  v1::GetNeighbourhoodReply reply;
  reply.set_cut(found->cut);
  reply.set_map_version(view->version());
  std::size_t landmarks = 0;
  for (const route::NeighbourhoodFrame& member : found->frames) {
    const auto hot = view->hot(member.frame);
    v1::NeighbourhoodFrame& frame = *reply.add_frames();
    *frame.mutable_frame() = to_wire(member.frame);
    *frame.mutable_root_from_frame() = to_wire(member.T_root_frame);
    frame.set_depth(member.depth);
    frame.set_distance_m(member.distance_m);
    frame.set_unmeasured_steps(member.unmeasured_steps);
    if (!hot) continue;
    frame.set_time_us(hot->time_us);
    for (const std::string& label : hot->labels) frame.add_labels(label);
    if (!request.landmarks()) continue;
    for (const storage::Landmark& landmark : hot->landmarks)
      *frame.add_landmarks() = to_wire(Vector3(member.T_root_frame * landmark.point()));
    landmarks += hot->landmarks.size();
    if (landmarks * kBytesPerLandmark > kMaxReplyBytes)
      return {Reason::BUDGET_EXCEEDED, "more landmarks than one answer holds; ask for fewer frames"};
  }
  for (const EdgeId id : found->edges)
    if (const auto edge = storage::find_edge(*view, id)) *reply.add_edges() = edge_message(*view, *edge);
  if (reply.ByteSizeLong() > kMaxReplyBytes)
    return {Reason::BUDGET_EXCEEDED,
            "an answer of " + std::to_string(reply.ByteSizeLong()) + " bytes; ask for fewer frames"};
  return reply;
}

Result<v1::GetFrameReply> get_frame(const v1::GetFrameRequest& request, const Deadline&, map::Mapper& mapper) {
  const auto view = mapper.view();
  const auto id = existing_frame(*view, request.has_frame(), request.frame(), "frame");
  if (!id.ok()) return id.status();
  auto frame = frame_message(
      *view, *id,
      {request.landmarks(), request.observations(), request.appearance(), request.thumbnail(), request.picture()});
  if (!frame.ok()) return frame.status();
  v1::GetFrameReply reply;
  *reply.mutable_frame() = std::move(frame).value();
  reply.set_map_version(view->version());
  return reply;
}

}  // namespace relmap::rpc
