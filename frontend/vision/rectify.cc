#include "frontend/vision/rectify.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "proto/base/number_text.h"

namespace relmap::vision {

struct Rectifier::Maps {
  // remap's fixed-point form: whole pixels, and fractions of 1/32.
  std::array<cv::Mat, 2> whole, fraction;
};

namespace {

cv::Matx33d intrinsics(const RawCamera& c) { return {c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1}; }
cv::Vec<double, 5> distortion(const RawCamera& c) { return {c.k1, c.k2, c.p1, c.p2, c.k3}; }

// Rectified directions of a grid of pixels of the raw picture, one per column.
Eigen::Matrix3Xd directions(const cv::Matx33d& K, const cv::Vec<double, 5>& D, const cv::Matx33d& R, cv::Size size) {
  constexpr int kColumns = 16, kRows = 12;
  std::vector<cv::Point2d> pixels, normalised;
  for (int row = 0; row < kRows; ++row)
    for (int column = 0; column < kColumns; ++column)
      pixels.emplace_back((column + 0.5) * size.width / kColumns, (row + 0.5) * size.height / kRows);
  cv::undistortPoints(pixels, normalised, K, D, R);
  Eigen::Matrix3Xd rays(3, pixels.size());
  for (std::size_t i = 0; i < normalised.size(); ++i)
    rays.col(static_cast<Eigen::Index>(i)) = Vector3(normalised[i].x, normalised[i].y, 1).normalized();
  return rays;
}

}  // namespace

Vector2 RawPixels::of(const Vector2& rectified) const {
  const Vector3 ray = R_rectified_raw_.transpose() * Vector3((rectified.x() - rectified_.cx) / rectified_.f,
                                                             (rectified.y() - rectified_.cy) / rectified_.f, 1);
  const double x = ray.x() / ray.z(), y = ray.y() / ray.z(), r2 = x * x + y * y;
  const double g = 1 + r2 * (lens_.k1 + r2 * (lens_.k2 + r2 * lens_.k3));
  return {lens_.fx * (g * x + 2 * lens_.p1 * x * y + lens_.p2 * (r2 + 2 * x * x)) + lens_.cx,
          lens_.fy * (g * y + lens_.p1 * (r2 + 2 * y * y) + 2 * lens_.p2 * x * y) + lens_.cy};
}

Result<Rectifier> Rectifier::make(const StereoCalibration& given, int width, int height) {
  StereoCalibration calibration = given;
  if (calibration.width == 0 && calibration.height == 0) {
    calibration.width = width;
    calibration.height = height;
  }
  if (calibration.width != width || calibration.height != height)
    return {Reason::BAD_SIZE, "pictures of " + size_text(width, height) + " with a calibration for " +
                                  size_text(calibration.width, calibration.height)};
  if (Status status = calibration.check_plausible(); !status.ok()) return status;

  Rectifier rectifier;
  if (calibration.rectified) {
    rectifier.camera_ = calibration.rectified_camera();
    rectifier.left_pixels_ = RawPixels(rectifier.camera_);
  } else {
    try {
      const cv::Size size(width, height);
      auto maps = std::make_shared<Maps>();
      const cv::Matx33d K1 = intrinsics(calibration.left);
      const auto D1 = distortion(calibration.left);
      if (calibration.mono()) {
        cv::Matx33d P = cv::getOptimalNewCameraMatrix(K1, D1, size, 0);
        P(0, 0) = P(1, 1) = std::max(P(0, 0), P(1, 1));  // square pixels
        cv::initUndistortRectifyMap(K1, D1, cv::Matx33d::eye(), P, size, CV_16SC2, maps->whole[0], maps->fraction[0]);
        rectifier.camera_ = {P(0, 0), P(0, 2), P(1, 2), 0, width, height};
      } else {
        const cv::Matx33d K2 = intrinsics(calibration.right);
        const auto D2 = distortion(calibration.right);
        cv::Matx33d R, R1, R2;
        cv::eigen2cv(calibration.T_right_left.R, R);
        const Vector3& t = calibration.T_right_left.t;
        cv::Mat P1, P2, Q;
        cv::stereoRectify(K1, D1, K2, D2, size, R, cv::Vec3d(t.x(), t.y(), t.z()), R1, R2, P1, P2, Q,
                          cv::CALIB_ZERO_DISPARITY, 0, size);
        cv::initUndistortRectifyMap(K1, D1, R1, P1, size, CV_16SC2, maps->whole[0], maps->fraction[0]);
        cv::initUndistortRectifyMap(K2, D2, R2, P2, size, CV_16SC2, maps->whole[1], maps->fraction[1]);
        const double f = P1.at<double>(0, 0);
        rectifier.camera_ = {f, P1.at<double>(0, 2), P1.at<double>(1, 2), -P2.at<double>(0, 3) / f, width, height};
        cv::cv2eigen(R1, rectifier.left_rotation_);
        const Eigen::Matrix4d turn = Eigen::umeyama(directions(K2, D2, R2, size), directions(K1, D1, R1, size), false);
        rectifier.eye_turn_ = so3_log(turn.topLeftCorner<3, 3>());
      }
      rectifier.maps_ = std::move(maps);
      rectifier.left_pixels_ = RawPixels(rectifier.camera_, calibration.left, rectifier.left_rotation_);
    } catch (const cv::Exception& error) {
      return {Reason::IMPLAUSIBLE_CALIBRATION, error.what()};
    }
  }
  if (Status status = rectifier.camera_.check_plausible(); !status.ok()) return status;
  return rectifier;
}

Status Rectifier::apply(ImageView raw, int eye, Image& out) const {
  if (raw.width != camera_.width || raw.height != camera_.height)
    return {Reason::BAD_SIZE, "a picture of " + size_text(raw.width, raw.height) + "; the calibration is for " +
                                  size_text(camera_.width, camera_.height)};
  const auto i = static_cast<std::size_t>(eye);
  if (maps_ && maps_->whole[i].empty()) return {Reason::NOT_STEREO, "the calibration is of one camera"};
  if (out.width() != raw.width || out.height() != raw.height) out = Image(raw.width, raw.height);
  if (!maps_) {
    for (int y = 0; y < raw.height; ++y) std::copy_n(raw.row(y), raw.width, out.row(y));
    return {};
  }
  const cv::Mat in(raw.height, raw.width, CV_8UC1, const_cast<std::uint8_t*>(raw.data),
                   static_cast<std::size_t>(raw.stride));
  // remap() writes into the memory it is given if size and type are right.
  cv::Mat into(out.height(), out.width(), CV_8UC1, out.row(0));
  cv::remap(in, into, maps_->whole[i], maps_->fraction[i], cv::INTER_LINEAR);
  return {};
}

Status Rectifier::left(ImageView raw, Image& out) const { return apply(raw, 0, out); }
Status Rectifier::right(ImageView raw, Image& out) const { return apply(raw, 1, out); }

Result<Image> Rectifier::left(ImageView raw) const {
  Image out;
  if (Status status = left(raw, out); !status.ok()) return status;
  return out;
}

Result<Image> Rectifier::right(ImageView raw) const {
  Image out;
  if (Status status = right(raw, out); !status.ok()) return status;
  return out;
}

}  // namespace relmap::vision
