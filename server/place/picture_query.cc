#include "server/place/picture_query.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "frontend/vision/exposure.h"
#include "frontend/vision/picture.h"
#include "frontend/vision/picture_appearance.h"
#include "frontend/vision/pyramid.h"
#include "frontend/vision/rectify.h"
#include "frontend/vision/stereo_match.h"
#include "proto/base/number_text.h"
#include "server/place/stereo_pair.h"

namespace relmap::place {

namespace {

constexpr float kMaxDisparity = 256;

// The pyramid level whose 9 x 9 patch covers about the same area as the descriptor's centre.
int matching_level(float scale, int levels) {
  return std::clamp(static_cast<int>(std::lround(std::log2(std::max(scale, 1.0F) / 4))), 0, levels - 1);
}

void add_disparities(vision::ImageView left, vision::ImageView right, std::vector<AppearanceFeature>& features) {
  const vision::Pyramid left_pyramid(vision::standardise(left, vision::measure_exposure(left)));
  const vision::Pyramid right_pyramid(vision::standardise(right, vision::measure_exposure(right)));
  vision::StereoMatchOptions options;
  options.max_disparity = std::min(kMaxDisparity, static_cast<float>(left.width) / 2);
  for (AppearanceFeature& feature : features) {
    const int level = matching_level(feature.scale, left_pyramid.levels());
    if (const auto match = vision::match_stereo(left_pyramid, right_pyramid, feature.u, feature.v, level, options))
      feature.disparity = match->disparity;
  }
}

struct CameraOf {
  int& width;
  int& height;
  bool& stereo;

  Status operator()(std::monostate) const { return {}; }
  Status operator()(const StereoCamera& camera) const {
    width = camera.width;
    height = camera.height;
    stereo = camera.is_stereo();
    return camera.check_plausible();
  }
  Status operator()(const StereoCalibration& calibration) const {
    width = calibration.width;
    height = calibration.height;
    stereo = !calibration.mono();
    return calibration.check_plausible();
  }
};

// Checks what can be checked before anything is decoded.
Status check_files(const PictureQuestion& question, const vision::PictureSize& left) {
  int width = 0, height = 0;
  bool stereo = false;
  if (Status status = std::visit(CameraOf{width, height, stereo}, question.calibration); !status.ok()) return status;
  if (width != 0 && (left.width != width || left.height != height))
    return {Reason::BAD_SIZE, "the picture has " + size_text(left.width, left.height) + " pixels, its camera " +
                                  size_text(width, height)};
  if (question.right.empty()) return {};
  if (!stereo) return {Reason::NOT_STEREO, "a right picture needs a calibration with a baseline"};
  const auto right = vision::picture_size(question.right);
  if (!right.ok()) return right.status();
  if (right->width != left.width || right->height != left.height)
    return {Reason::BAD_SIZE, "the right picture has " + size_text(right->width, right->height) +
                                  " pixels, the left one " + size_text(left.width, left.height)};
  return {};
}

}  // namespace

Result<PictureCalibration> camera_of_session(const storage::Session& session, std::optional<ByteSpan> left,
                                             bool rectified) {
  if (storage::is_going(session)) return {Reason::SESSION_DELETED, "session " + session.display_name + " was deleted"};
  const StereoCamera& camera = session.header.camera;
  if (camera == kNoCamera)
    return {Reason::NO_CALIBRATION, "session " + std::to_string(session.number) + " was imported without a camera"};
  const auto& raw = session.header.raw;
  if (!raw || rectified || !left) return PictureCalibration(camera);
  const auto size = vision::picture_size(*left);
  if (!size.ok()) return size.status();
  if (size->width == raw->width && size->height == raw->height) return PictureCalibration(*raw);
  if (size->width == camera.width && size->height == camera.height) return PictureCalibration(camera);
  return {Reason::BAD_SIZE, "the picture has " + size_text(size->width, size->height) +
                                " pixels; the camera of session " + std::to_string(session.number) + " takes " +
                                size_text(raw->width, raw->height) + ", rectified " +
                                size_text(camera.width, camera.height)};
}

Result<DescribedPicture> describe_picture(const PictureQuestion& question) {
  const auto size = vision::picture_size(question.left);
  if (!size.ok()) return size.status();
  if (Status status = check_files(question, *size); !status.ok()) return status;

  auto left = vision::decode_picture(question.left);
  if (!left.ok()) return left.status();
  vision::Image left_grey = std::move(left->grey), right_grey;
  const int width = left_grey.width(), height = left_grey.height();
  if (!question.right.empty()) {
    auto right = vision::decode_picture(question.right);
    if (!right.ok()) return right.status();
    right_grey = std::move(right->grey);
    if (right_grey.width() != width || right_grey.height() != height)
      return {Reason::BAD_SIZE,
              "left and right picture were reduced to different sizes: give both as JPEG or both as "
              "PNG"};
  }

  DescribedPicture result;
  result.scale = static_cast<double>(width) / size->width;
  result.sent = {std::nullopt, result.scale, static_cast<double>(height) / size->height};
  result.camera = {0, 0.5 * (width - 1), 0.5 * (height - 1), 0, width, height};
  if (const auto* camera = std::get_if<StereoCamera>(&question.calibration)) {
    result.camera = vision::reduced(*camera, width, height);
  } else if (const auto* calibration = std::get_if<StereoCalibration>(&question.calibration)) {
    StereoCalibration known = *calibration;
    if (known.width == 0) known.width = size->width, known.height = size->height;
    const auto rectifier = vision::Rectifier::make(vision::reduced(known, width, height), width, height);
    if (!rectifier.ok()) return rectifier.status();
    result.camera = rectifier->camera();
    result.eye_turn = rectifier->eye_turn();
    result.sent.raw = rectifier->left_pixels();
    auto rectified = rectifier->left(left_grey);
    if (!rectified.ok()) return rectified.status();
    left_grey = std::move(rectified).value();
    if (!right_grey.empty()) {
      rectified = rectifier->right(right_grey);
      if (!rectified.ok()) return rectified.status();
      right_grey = std::move(rectified).value();
    }
  }

  if (!right_grey.empty() && vision::measure_exposure(right_grey).blind())
    right_grey = vision::Image();  // the left picture is used alone
  if (!right_grey.empty())
    if (Status status = check_stereo_pair(left_grey, right_grey, result.camera); !status.ok()) return status;
  result.features = vision::picture_appearance(left_grey);
  if (!right_grey.empty())
    add_disparities(left_grey, right_grey, result.features);
  else
    result.camera.baseline = 0;
  return result;
}

}  // namespace relmap::place
