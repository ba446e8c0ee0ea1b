#include "server/rpc/evidence_messages.h"

#include "frontend/vision/picture.h"
#include "proto/wire/convert.h"
#include "server/map/edge_choice.h"
#include "server/map/suspicion.h"
#include "server/rpc/messages.h"
#include "storage/graph/digest.h"

namespace relmap::rpc {

namespace {

static_assert(static_cast<int>(map::DoubtKind::kFewInliers) == v1::DOUBT_KIND_FEW_INLIERS);
static_assert(static_cast<int>(map::DoubtKind::kRunnerUp) == v1::DOUBT_KIND_RUNNER_UP);
static_assert(static_cast<int>(map::DoubtKind::kContradiction) == v1::DOUBT_KIND_CONTRADICTION);
static_assert(static_cast<int>(map::DoubtKind::kUnseen) == v1::DOUBT_KIND_UNSEEN);

v1::FramePicture no_picture(Reason reason, std::string message) {
  v1::FramePicture picture;
  picture.set_reason(to_wire(reason));
  picture.set_message(std::move(message));
  return picture;
}

// Why a frame that is there has no picture.
v1::FramePicture why_no_picture(const storage::Graph& graph, FrameId frame, const storage::FrameCold* cold) {
  const auto session = graph.session(frame.session);
  if (session && session->header.camera == kNoCamera)
    return no_picture(Reason::UNSUPPORTED, frame.to_string() + " was imported: the map has no picture of it");
  if (graph.hot(frame)->appearance_count > 0 && (!cold || cold->appearance.empty()))
    return no_picture(Reason::DATA_LOSS, "the part that held the picture of " + frame.to_string() + " was lost");
  return no_picture(Reason::UNSUPPORTED, "the robot sent no picture with " + frame.to_string());
}

}  // namespace

void add_correspondences(std::span<const place::PointMatch> matches, std::span<const AppearanceFeature> features,
                         const place::SentPixels& sent, google::protobuf::RepeatedPtrField<v1::Correspondence>& into) {
  for (const place::PointMatch& match : matches) {
    if (into.size() == kMaxCorrespondences) return;
    v1::Correspondence& added = *into.Add();
    const AppearanceFeature& feature = features[match.feature];
    const Vector2 pixel = sent.of({feature.u, feature.v});
    added.set_u(static_cast<float>(pixel.x()));
    added.set_v(static_cast<float>(pixel.y()));
    added.set_frame_u(static_cast<float>(match.pixel.x()));
    added.set_frame_v(static_cast<float>(match.pixel.y()));
    added.set_inlier(match.inlier);
    if (match.residual) added.set_residual(static_cast<float>(*match.residual / sent.columns));
    if (match.seen_in.valid()) *added.mutable_seen_in() = to_wire(match.seen_in);
  }
}

v1::FramePicture picture_message(const storage::Graph& graph, FrameId frame) {
  const auto hot = graph.hot(frame);
  if (!hot || !hot->present) return no_picture(Reason::NO_SUCH_FRAME, "no frame " + frame.to_string());
  std::shared_ptr<const storage::FrameCold> cold;
  try {
    cold = graph.cold(frame);
  } catch (const StatusError& error) {
    if (error.status().reason() != Reason::DATA_LOSS) throw;
    return no_picture(Reason::DATA_LOSS, error.status().message());
  }
  if (!cold || cold->picture.empty()) return why_no_picture(graph, frame, cold.get());
  const auto size = vision::picture_size(cold->picture);
  if (!size.ok())
    return no_picture(size.reason(), "the picture of " + frame.to_string() + ": " + size.status().message());
  v1::FramePicture picture;
  picture.set_data(cold->picture.data(), cold->picture.size());
  picture.set_width(static_cast<std::uint32_t>(size->width));
  picture.set_height(static_cast<std::uint32_t>(size->height));
  const auto session = graph.session(frame.session);
  picture.set_scale(session ? static_cast<double>(size->width) / session->header.camera.width : 1);
  picture.set_reason(to_wire(Reason::OK));
  return picture;
}

void tell_suspicion(const storage::Edge& edge, v1::Edge& message) {
  if (edge.kind != storage::EdgeKind::kLoop) return;
  const map::Suspicion suspicion = map::suspicion_of(storage::digest_of(edge));
  v1::Suspicion& told = *message.mutable_suspicion();
  told.set_value(map::listed_suspicion(edge));
  told.set_remark(suspicion.remark);
  for (const map::Doubt& doubt : suspicion.doubts) {
    v1::Doubt& added = *told.add_doubts();
    added.set_kind(static_cast<v1::DoubtKind>(doubt.kind));
    added.set_weight(doubt.weight);
    added.set_message(doubt.message);
  }
}

}  // namespace relmap::rpc
