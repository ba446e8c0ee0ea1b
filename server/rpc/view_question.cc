#include "server/rpc/view_question.h"

#include <limits>
#include <string>
#include <utility>

#include "frontend/vision/picture.h"
#include "proto/base/number_text.h"
#include "proto/geometry/camera.h"
#include "proto/wire/convert.h"
#include "server/map/lookup.h"
#include "server/rpc/messages.h"
#include "server/rpc/picture_query.h"

namespace relmap::rpc {

namespace {

// The session's camera that took the view's picture: the raw one or, if the picture is rectified or the view holds
// features, the rectified one.
Result<PictureCalibration> camera_of(const storage::Session& session, const v1::View& view) {
  const StereoCamera& camera = session.header.camera;
  const auto& raw = session.header.raw;
  if (!raw || view.rectified() || !view.has_left()) return PictureCalibration(camera);
  const auto size = vision::picture_size(as_bytes(view.left().data()));
  if (!size.ok()) return size.status();
  if (size->width == raw->width && size->height == raw->height) return PictureCalibration(*raw);
  if (size->width == camera.width && size->height == camera.height) return PictureCalibration(camera);
  return {Reason::BAD_SIZE, "the picture has " + size_text(size->width, size->height) +
                                " pixels; the camera of session " + std::to_string(session.number) + " takes " +
                                size_text(raw->width, raw->height) + ", rectified " +
                                size_text(camera.width, camera.height)};
}

Result<PictureCalibration> calibration_of(const v1::View& view, const storage::Graph& graph) {
  if (view.rectified() && view.calibration_case() != v1::View::kSession)
    return {Reason::INVALID_ARGUMENT, "rectified can only be said of pictures of a session's camera"};
  if (view.either_eye() && view.calibration_case() != v1::View::kSession)
    return {Reason::INVALID_ARGUMENT, "either_eye can only be said of pictures of a session's camera"};
  switch (view.calibration_case()) {
    case v1::View::kCamera: {
      const auto camera = from_wire(view.camera());
      if (!camera.ok()) return camera.status();
      return PictureCalibration(*camera);
    }
    case v1::View::kRaw: {
      const auto raw = from_wire(view.raw());
      if (!raw.ok()) return raw.status();
      return PictureCalibration(*raw);
    }
    case v1::View::kSession: {
      const auto session = graph.session(view.session());
      if (!session) return {Reason::NO_SUCH_SESSION, "no session " + std::to_string(view.session())};
      if (storage::is_going(*session))
        return {Reason::SESSION_DELETED, "session " + session->display_name + " was deleted"};
      if (session->header.camera == kNoCamera)
        return {Reason::NO_CALIBRATION, "session " + std::to_string(view.session()) + " was imported without a camera"};
      return camera_of(*session, view);
    }
    case v1::View::CALIBRATION_NOT_SET:
      break;
  }
  return PictureCalibration();
}

place::CameraKnown how_known(const v1::View& view) {
  return view.supposed() ? place::CameraKnown::kSupposed : place::CameraKnown::kNamed;
}

Result<SeenView> see_features(const v1::View& view, const PictureCalibration& calibration) {
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
  seen.masked.push_back({frame->session, map::first_recent(graph, *frame), std::numeric_limits<std::uint32_t>::max()});
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
      auto described = describe_picture({as_bytes(view.left().data()), as_bytes(view.right().data()), *calibration});
      if (!described.ok()) return described.status();
      const bool pair = described->camera.is_stereo();
      SeenView seen{std::move(described->features), described->camera, described->scale, {}, pair, how_known(view)};
      if (view.either_eye() && !view.has_right()) seen.eye_turn = described->eye_turn;
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
