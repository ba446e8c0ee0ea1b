#include "tools/relmap/pairs.h"

#include <cmath>

#include "client/map_colours.h"
#include "tools/relmap/edge_words.h"

namespace relmap::cli {

namespace {

using client::FramePicture;
using client::PairPicture;

const StereoCamera* camera_of(FrameId frame, const SessionsByNumber& sessions) {
  const auto found = sessions.find(frame.session);
  return found == sessions.end() || found->second.camera.width == 0 ? nullptr : &found->second.camera;
}

// The thumbnail as a picture of the camera; what `none` says if there is none.
FramePicture thumbnail_of(const client::Frame& frame, const SessionsByNumber& sessions, FramePicture none) {
  const StereoCamera* const camera = camera_of(frame.id, sessions);
  const auto size = client::picture_size(frame.thumbnail);
  if (!camera || !size.ok()) return none;
  return {frame.thumbnail,
          static_cast<std::uint32_t>(size->x()),
          static_cast<std::uint32_t>(size->y()),
          size->x() / camera->width,
          {}};
}

PairPicture::Side side_of(FrameId frame, std::int64_t time_us, FramePicture picture, const SessionsByNumber& sessions) {
  PairPicture::Side side;
  side.title = frame.to_string();
  side.details = {(time_us == 0 ? "" : time_text(time_us) + ", ") + session_words(sessions, frame.session)};
  side.picture = std::move(picture);
  if (const StereoCamera* const camera = camera_of(frame, sessions)) {
    side.camera_width = camera->width;
    side.camera_height = camera->height;
  }
  return side;
}

// Pictures are asked for once, with the explanation; what it does not have is taken from the frame.
PairPicture::Side side_of(FrameId id, const std::optional<FramePicture>& picture, const SessionsByNumber& sessions,
                          client::Client& client) {
  const auto frame = client.frame(id, true);
  FramePicture shown = picture.value_or(FramePicture{});
  if (!picture) shown.missing = {Reason::UNSUPPORTED, "the daemon sent none"};
  const bool dropped = !shown.missing.ok();
  if (dropped && frame.ok()) {
    const std::string why = shown.missing.message();
    shown = thumbnail_of(*frame, sessions, shown);
    PairPicture::Side side = side_of(id, frame->time_us, shown, sessions);
    if (shown.missing.ok()) side.details.push_back("a thumbnail only: " + why);
    return side;
  }
  return side_of(id, frame.ok() ? frame->time_us : 0, shown, sessions);
}

std::vector<PairPicture::Point> points_of(const std::vector<client::Correspondence>& correspondences,
                                          bool view_at_left) {
  std::vector<PairPicture::Point> points;
  for (const client::Correspondence& match : correspondences)
    points.push_back({view_at_left ? match.in_view : match.in_frame, view_at_left ? match.in_frame : match.in_view,
                      match.inlier, match.seen_in.has_value()});
  return points;
}

}  // namespace

FramePicture kept_picture(FrameId id, const SessionsByNumber& sessions, client::Client& client) {
  const auto frame = client.frame(id, true, true);
  FramePicture none;
  if (!frame.ok()) {
    none.missing = frame.status();
    return none;
  }
  if (frame->picture && frame->picture->missing.ok()) return *frame->picture;
  none.missing = frame->picture ? frame->picture->missing : Status(Reason::UNSUPPORTED, "the daemon keeps none");
  return thumbnail_of(*frame, sessions, none);
}

PairPicture pair_of(const client::EdgeExplanation& explained, const SessionsByNumber& sessions,
                    client::Client& client) {
  constexpr std::size_t kMaxDoubts = 4;
  const client::Edge& edge = explained.edge;
  PairPicture pair;
  pair.title = edge.id.to_string() + ": " + name_of(edge.state) + ", " + std::string(reason_name(edge.reason)) +
               (*explanation(edge.reason) ? " (" + std::string(explanation(edge.reason)) + ")" : "");
  pair.left = side_of(edge.a, explained.picture_a, sessions, client);
  pair.right = side_of(edge.b, explained.picture_b, sessions, client);
  pair.points = points_of(explained.correspondences, false);
  if (pair.points.empty()) pair.no_points = no_points_text(explained.correspondences_missing);
  if (edge.suspicion) {
    pair.gauges.push_back(
        {edge.suspicion->value, "suspicion " + fixed(edge.suspicion->value, 2) + " of 1", client::kQueryColour, true});
    const std::vector<client::Doubt> doubts = doubts_of(*edge.suspicion);
    for (const client::Doubt& doubt : doubts)
      if (pair.gauges.size() <= kMaxDoubts)
        pair.gauges.push_back({doubt.weight, doubt_text(doubt), client::kQueryColour, false});
    if (doubts.empty()) pair.notes.push_back("Nothing speaks against it.");
    if (!edge.suspicion->remark.empty()) pair.notes.push_back(edge.suspicion->remark);
  }
  if (explained.runner_up && edge.uniqueness && edge.uniqueness->runner_up) {
    pair.other = side_of(*edge.uniqueness->runner_up, explained.runner_up, sessions, client);
    pair.other->title = "Another place that fits: " + pair.other->title + ", " +
                        counted_text(edge.uniqueness->runner_up_inliers, "inlier");
  }
  pair.notes.push_back("Motion: " + verdict_text(explained.motion));
  if (const std::string text = agreements_text(explained); !text.empty()) pair.notes.push_back(text);
  return pair;
}

PairPicture pair_of(const AskedView& view, const client::PlaceMatch& place, const SessionsByNumber& sessions,
                    client::Client& client) {
  PairPicture pair;
  const bool confirmed = place.unverified.ok();
  pair.title = place.frame.to_string() + (confirmed ? ": confirmed" : ": not confirmed");
  pair.left.title = view.title;
  pair.left.picture = view.picture;
  pair.right = side_of(place.frame, std::optional(kept_picture(place.frame, sessions, client)), sessions, client);
  pair.points = points_of(place.correspondences, true);
  if (pair.points.empty()) pair.no_points = confirmed ? "the daemon sent no matches" : no_points_text(place.unverified);
  pair.gauges.push_back({place.probability, "probability " + fixed(place.probability, 3) + " by appearance",
                         client::session_colour(0), true});
  if (confirmed)
    pair.notes.push_back("Geometry confirms it (" + std::string(name_of(place.verification)) +
                         "): " + std::to_string(place.inliers) + " inliers over " + fixed(100 * place.spread, 0) +
                         " % of the picture.");
  else
    pair.notes.push_back(std::string(reason_name(place.unverified.reason())) +
                         (place.unverified.message().empty() ? "" : ": " + place.unverified.message()));
  if (place.T_frame_view)
    pair.notes.push_back(fixed(place.T_frame_view->t.norm(), 2) + " m from there, turned by " +
                         fixed(rotation_angle(place.T_frame_view->R) * 180 / M_PI, 1) + " degrees.");
  return pair;
}

}  // namespace relmap::cli
