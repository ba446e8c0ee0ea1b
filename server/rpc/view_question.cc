#include "server/rpc/view_question.h"

#include <string>
#include <utility>

#include "proto/wire/convert.h"
#include "server/map/lookup.h"
#include "server/place/picture_query.h"
#include "server/rpc/messages.h"

namespace relmap::rpc {

namespace {

Result<place::PictureCalibration> calibration_of(const v1::View& view, const storage::Graph& graph) {
  if (view.rectified() && view.calibration_case() != v1::View::kSession)
    return {Reason::INVALID_ARGUMENT, "rectified can only be said of pictures of a session's camera"};
  if (view.either_eye() && view.calibration_case() != v1::View::kSession)
    return {Reason::INVALID_ARGUMENT, "either_eye can only be said of pictures of a session's camera"};
  switch (view.calibration_case()) {
    case v1::View::kCamera: {
      const auto camera = from_wire(view.camera());
      if (!camera.ok()) return camera.status();
      return place::PictureCalibration(*camera);
    }
    case v1::View::kRaw: {
      const auto raw = from_wire(view.raw());
      if (!raw.ok()) return raw.status();
      return place::PictureCalibration(*raw);
    }
    case v1::View::kSession: {
      const auto session = storage::existing_session(graph, view.session());
      if (!session.ok()) return session.status();
      const auto left = view.has_left() ? std::optional(as_bytes(view.left().data())) : std::nullopt;
      return place::camera_of_session(*session, left, view.rectified());
    }
    case v1::View::CALIBRATION_NOT_SET:
      break;
  }
  return place::PictureCalibration();
}

place::CameraKnown how_known(const v1::View& view) {
  return view.supposed() ? place::CameraKnown::kSupposed : place::CameraKnown::kNamed;
}

Result<SeenView> see_features(const v1::View& view, const place::PictureCalibration& calibration) {
  auto features = from_wire(view.features());
  if (!features.ok()) return features.status();
  if (std::holds_alternative<StereoCalibration>(calibration))
    return {Reason::INVALID_ARGUMENT, "features must be of a rectified picture: give its rectified camera"};
  SeenView seen;
  seen.features = std::move(features).value();
  if (const auto* camera = std::get_if<StereoCamera>(&calibration)) seen.camera = *camera;
  seen.known = how_known(view);
  return seen;
}

Result<SeenView> see_frame(const v1::View& view, const storage::Graph& graph) {
  if (view.has_right() || view.calibration_case() != v1::View::CALIBRATION_NOT_SET)
    return {Reason::INVALID_ARGUMENT, "the camera of a frame of the map is that of its session: name no other"};
  const auto frame = existing_frame(graph, true, view.frame(), "frame");
  if (!frame.ok()) return frame.status();
  const auto session = graph.session(frame->session);
  const auto cold = graph.cold(*frame);
  if (!session || !cold) return {Reason::NO_SUCH_FRAME, "no frame " + frame->to_string()};
  SeenView seen;
  seen.features = cold->appearance;
  seen.camera = session->header.camera;
  seen.masked.push_back(map::recent_past(graph, *frame));
  return seen;
}

}  // namespace

Result<SeenView> see(const v1::View& view, const storage::Graph& graph) {
  const auto calibration = calibration_of(view, graph);
  if (!calibration.ok()) return calibration.status();
  switch (view.content_case()) {
    case v1::View::kFeatures:
      return see_features(view, *calibration);
    case v1::View::kLeft: {
      auto described =
          place::describe_picture({as_bytes(view.left().data()), as_bytes(view.right().data()), *calibration});
      if (!described.ok()) return described.status();
      const bool pair = described->camera.is_stereo();
      SeenView seen{std::move(described->features), described->camera, described->scale, {}, pair, how_known(view)};
      if (view.either_eye() && !view.has_right()) seen.eye_turn = described->eye_turn;
      seen.sent = described->sent;
      return seen;
    }
    case v1::View::kFrame:
      return see_frame(view, graph);
    case v1::View::CONTENT_NOT_SET:
      break;
  }
  return {Reason::INVALID_ARGUMENT, "the view holds neither a picture nor features nor a frame"};
}

v1::View without_camera(v1::View view) {
  view.clear_calibration();
  view.clear_supposed();
  view.clear_either_eye();
  view.clear_rectified();
  return view;
}

}  // namespace relmap::rpc
