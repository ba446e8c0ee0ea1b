#include "server/rpc/view_question.h"

#include "proto/wire/convert.h"
#include "server/rpc/picture_query.h"

namespace relmap {

namespace {

Result<PictureCalibration> calibration_of(const v1::View& view, const Graph& graph) {
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
      return PictureCalibration(session->header.camera);
    }
    case v1::View::CALIBRATION_NOT_SET:
      break;
  }
  return PictureCalibration();
}

Result<SeenView> see_features(const v1::View& view, const PictureCalibration& calibration) {
  auto features = from_wire(view.features());
  if (!features.ok()) return features.status();
  if (std::holds_alternative<StereoCalibration>(calibration))
    return {Reason::INVALID_ARGUMENT, "features are those of a rectified picture: give its rectified camera"};
  SeenView seen{std::move(features).value(), std::nullopt};
  if (const auto* camera = std::get_if<StereoCamera>(&calibration)) seen.camera = *camera;
  return seen;
}

}  // namespace

Result<SeenView> see(const v1::View& view, const Graph& graph) {
  const auto calibration = calibration_of(view, graph);
  if (!calibration.ok()) return calibration.status();
  switch (view.content_case()) {
    case v1::View::kFeatures:
      return see_features(view, *calibration);
    case v1::View::kLeft: {
      auto described = describe_picture({as_bytes(view.left().data()), as_bytes(view.right().data()), *calibration});
      if (!described.ok()) return described.status();
      return SeenView{std::move(described->features), described->camera};
    }
    case v1::View::CONTENT_NOT_SET:
      break;
  }
  return {Reason::INVALID_ARGUMENT, "the view holds neither a picture nor features"};
}

}  // namespace relmap
