#include "proto/wire/convert.h"
#include "server/rpc/handlers.h"
#include "server/rpc/localise.h"
#include "server/rpc/messages.h"
#include "server/rpc/place_messages.h"
#include "server/rpc/view_question.h"

namespace relmap {

namespace {

constexpr std::uint32_t kDefaultPlaces = 20;
constexpr std::uint32_t kDefaultVerified = 3;
constexpr std::uint32_t kMaxVerified = 20;

}  // namespace

Result<v1::LocaliseReply> localise_view(Core& core, const MapView& view, const v1::View& asked,
                                        std::optional<FrameId> prior, const Deadline& deadline) {
  const auto seen = see(asked, view);
  if (!seen.ok()) return seen.status();
  const PlaceKnowledge map{view, core.mapper.places(), core.mapper.vocabulary()};
  const auto found = localise_features(map, {seen->features, seen->camera, prior}, deadline);
  if (!found.ok()) return found.status();
  v1::LocaliseReply reply;
  *reply.mutable_frame() = to_wire(found->place.match);
  *reply.mutable_frame_from_view() = to_wire(found->place.T_match_query);
  *reply.mutable_covariance() = to_wire(found->place.covariance);
  reply.set_inliers(found->place.inliers);
  reply.set_verification(to_wire(found->place.verification));
  reply.set_probability(found->probability);
  reply.set_spread(found->place.spread);
  reply.set_new_place(found->new_place);
  reply.set_candidates(found->verified_candidates);
  reply.set_map_version(view.version());
  return reply;
}

Result<v1::LocaliseReply> localise(Core& core, const v1::LocaliseRequest& request, const Deadline& deadline) {
  const auto view = core.mapper.view();
  std::optional<FrameId> prior;
  if (request.has_prior()) {
    const auto frame = existing_frame(*view, true, request.prior(), "prior");
    if (!frame.ok()) return frame.status();
    prior = *frame;
  }
  return localise_view(core, *view, request.view(), prior, deadline);
}

Result<v1::MatchImageReply> match_image(Core& core, const v1::MatchImageRequest& request, const Deadline& deadline) {
  const auto view = core.mapper.view();
  const auto seen = see(request.view(), *view);
  if (!seen.ok()) return seen.status();
  const std::uint32_t most = request.max_places() == 0 ? kDefaultPlaces : request.max_places();
  const std::uint32_t verified =
      std::min(kMaxVerified, request.max_verified() == 0 ? kDefaultVerified : request.max_verified());
  const PlaceKnowledge map{*view, core.mapper.places(), core.mapper.vocabulary()};
  const auto found = match_features(map, {seen->features, seen->camera, std::nullopt}, verified, deadline);
  if (!found.ok()) return found.status();
  v1::MatchImageReply reply;
  reply.set_new_place(found->new_place);
  reply.set_map_version(view->version());
  for (const PlaceMatch& match : found->places) {
    if (static_cast<std::uint32_t>(reply.places_size()) == most) break;
    v1::PlaceMatch& place = *reply.add_places();
    *place.mutable_frame() = to_wire(match.frame);
    place.set_probability(match.probability);
    if (!match.verified) continue;
    place.set_verification(to_wire(match.verified->verification));
    place.set_inliers(match.verified->inliers);
    if (!in_metres(match.verified->verification)) continue;
    *place.mutable_frame() = to_wire(match.verified->match);
    *place.mutable_frame_from_view() = to_wire(match.verified->T_match_query);
    *place.mutable_covariance() = to_wire(match.verified->covariance);
  }
  return reply;
}

}  // namespace relmap
