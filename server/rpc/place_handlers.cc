#include "frontend/vision/encoded_picture.h"
#include "proto/wire/convert.h"
#include "server/place/supposed_camera.h"
#include "server/rpc/evidence_messages.h"
#include "server/rpc/handlers.h"
#include "server/rpc/messages.h"
#include "server/rpc/place_messages.h"
#include "server/rpc/view_question.h"

namespace relmap::rpc {

namespace {

constexpr std::uint32_t kDefaultPlaces = 20;
constexpr std::uint32_t kDefaultVerified = 10;
constexpr std::uint32_t kMaxVerified = 20;

v1::Verification verification_of(const place::VerifiedPlace& place) {
  return place.homography ? v1::VERIFICATION_HOMOGRAPHY : to_wire(place.verification);
}

// How a view is asked about, beside what it shows.
struct Asked {
  std::optional<FrameId> prior;
  bool correspondences = false;
};

place::PlaceQuestion question_of(const SeenView& seen, const Asked& asked) {
  return {seen.features, seen.camera, seen.masked,   asked.prior,
          seen.pair,     seen.known,  seen.eye_turn, asked.correspondences};
}

// Sees a single picture again with an unknown camera, and replaces `seen` by that. Empty for a pair or features, which
// cannot be seen without their camera.
place::DescribeWithoutCamera see_again(const v1::View& shown, const storage::MapView& view, const Asked& asked,
                                       SeenView& seen) {
  if (!shown.has_left() || shown.has_right()) return {};
  return [&shown, &view, asked, &seen]() -> Result<place::PlaceQuestion> {
    auto other = see(without_camera(shown), view);
    if (!other.ok()) return other.status();
    seen = std::move(other).value();
    return question_of(seen, asked);
  };
}

// The estimated focal length, in pixels of the given picture; 0 if the camera was known.
double estimated_focal_length(const SeenView& seen, const place::VerifiedPlace& place) {
  return seen.camera && seen.camera->f == 0 ? place.focal_length / seen.scale : 0;
}

v1::PlaceMatch match_message(const storage::MapView& view, const SeenView& seen, const place::PlaceMatch& match,
                             bool thumbnail) {
  v1::PlaceMatch message;
  *message.mutable_frame() = to_wire(match.shown());
  message.set_probability(match.probability);
  add_correspondences(match.matches, seen.features, seen.sent, *message.mutable_correspondences());
  if (thumbnail)
    if (const auto cold = view.cold(match.shown())) {
      const Bytes small = vision::thumbnail_of(cold->picture);
      message.set_thumbnail(small.data(), small.size());
    }
  if (!match.verified) {
    message.set_reason(to_wire(match.unverified.reason()));
    message.set_message(match.unverified.message());
    if (match.doubted) {
      message.set_inliers(match.doubted->inliers);
      message.set_spread(match.doubted->spread);
    }
    return message;
  }
  const place::VerifiedPlace& place = *match.verified;
  message.set_verification(verification_of(place));
  message.set_inliers(place.inliers);
  message.set_spread(place.spread);
  message.set_estimated_focal_length(estimated_focal_length(seen, place));
  if (!storage::is_metric(place.verification)) return message;
  *message.mutable_frame_from_view() = to_wire(place.T_match_query);
  *message.mutable_covariance() = to_wire(place.covariance);
  return message;
}

Result<std::optional<FrameId>> frame_if_given(const storage::Graph& graph, bool given, const v1::FrameId& id,
                                              const char* what) {
  if (!given) return std::optional<FrameId>();
  const auto frame = existing_frame(graph, true, id, what);
  if (!frame.ok()) return frame.status();
  return std::optional(*frame);
}

}  // namespace

Result<v1::LocaliseReply> localise_view(map::Mapper& mapper, const storage::MapView& view, const v1::View& shown,
                                        std::optional<FrameId> prior, const Deadline& deadline, bool correspondences) {
  auto seen = see(shown, view);
  if (!seen.ok()) return seen.status();
  const place::PlaceKnowledge map{view, mapper.places(), mapper.vocabulary()};
  const Asked asked{prior, correspondences};
  const auto found = place::localise_features(map, question_of(*seen, asked), see_again(shown, view, asked, *seen),
                                              [&] { return deadline.check(); });
  if (!found.ok()) return found.status();
  v1::LocaliseReply reply;
  *reply.mutable_frame() = to_wire(found->place.match);
  *reply.mutable_frame_from_view() = to_wire(found->place.T_match_query);
  *reply.mutable_covariance() = to_wire(found->place.covariance);
  reply.set_inliers(found->place.inliers);
  reply.set_verification(to_wire(found->place.verification));
  reply.set_near_prior(found->near_prior);
  if (!found->near_prior) {
    reply.set_probability(found->probability);
    reply.set_new_place(found->new_place);
  }
  reply.set_spread(found->place.spread);
  reply.set_estimated_focal_length(estimated_focal_length(*seen, found->place));
  reply.set_candidates(found->verified_candidates);
  add_correspondences(found->matches, seen->features, seen->sent, *reply.mutable_correspondences());
  reply.set_map_version(view.version());
  return reply;
}

Result<v1::LocaliseReply> localise(const v1::LocaliseRequest& request, const Deadline& deadline, map::Mapper& mapper) {
  const auto view = mapper.view();
  const auto prior = frame_if_given(*view, request.has_prior(), request.prior(), "prior");
  if (!prior.ok()) return prior.status();
  return localise_view(mapper, *view, request.view(), *prior, deadline, request.correspondences());
}

Result<v1::MatchImageReply> match_image(const v1::MatchImageRequest& request, const Deadline& deadline,
                                        map::Mapper& mapper) {
  const auto view = mapper.view();
  const auto near = frame_if_given(*view, request.has_near(), request.near(), "near");
  if (!near.ok()) return near.status();
  auto seen = see(request.view(), *view);
  if (!seen.ok()) return seen.status();
  const std::uint32_t max_places = request.max_places() == 0 ? kDefaultPlaces : request.max_places();
  const std::uint32_t verified =
      std::min(kMaxVerified, request.max_verified() == 0 ? kDefaultVerified : request.max_verified());
  const place::PlaceKnowledge map{*view, mapper.places(), mapper.vocabulary()};
  const Asked asked{*near, request.correspondences()};
  const auto found =
      place::match_features(map, question_of(*seen, asked), see_again(request.view(), *view, asked, *seen), verified,
                            [&] { return deadline.check(); });
  if (!found.ok()) return found.status();
  v1::MatchImageReply reply;
  reply.set_new_place(found->new_place);
  reply.set_map_version(view->version());
  reply.set_reason(to_wire(found->nothing_verified.reason()));
  reply.set_message(found->nothing_verified.message());
  for (const place::PlaceMatch& match : found->places) {
    if (static_cast<std::uint32_t>(reply.places_size()) == max_places) break;
    *reply.add_places() = match_message(*view, *seen, match, request.thumbnails());
  }
  return reply;
}

}  // namespace relmap::rpc
