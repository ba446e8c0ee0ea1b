// Rectifies raw stereo pictures: turns them into those of a rectified StereoCamera.
#pragma once

#include <memory>

#include "frontend/vision/image.h"
#include "proto/base/status.h"
#include "proto/calibration/calibration.h"
#include "proto/geometry/camera.h"

namespace relmap::vision {

// Tells where a raw picture shows what its rectified picture shows.
class RawPixels {
 public:
  // Pixels that are not distorted: `camera` is that of the rectified picture.
  explicit RawPixels(const StereoCamera& camera)
      : rectified_(camera), lens_{camera.f, camera.f, camera.cx, camera.cy} {}
  RawPixels(const StereoCamera& rectified, const RawCamera& lens, const Matrix3& R_rectified_raw)
      : rectified_(rectified), lens_(lens), R_rectified_raw_(R_rectified_raw) {}

  // The pixel of the raw picture that is at `rectified` after rectification.
  Vector2 of(const Vector2& rectified) const;

 private:
  StereoCamera rectified_;
  RawCamera lens_;
  Matrix3 R_rectified_raw_ = Matrix3::Identity();
};

// Bouguet's rectification, as OpenCV's stereoRectify does it, scaled so that every rectified pixel is seen and with
// principal points at the same place in both pictures. Pictures that are rectified already pass through. The look-up
// tables are made once; left() and right() may be called from several threads.
class Rectifier {
 public:
  // `width` and `height` are those of the pictures. They must agree with the calibration's, or complete a calibration
  // that has none. IMPLAUSIBLE_CALIBRATION, BAD_SIZE.
  static Result<Rectifier> make(const StereoCalibration& calibration, int width, int height);

  const StereoCamera& camera() const { return camera_; }
  bool passes_through() const { return maps_ == nullptr; }
  // Of the left eye. Holds none of the look-up tables.
  const RawPixels& left_pixels() const { return left_pixels_; }
  // R_rectified_raw of the left eye. The coordinate frame of a keyframe is that of its rectified left camera.
  const Matrix3& left_rotation() const { return left_rotation_; }
  // The rotation (vector, radians) by which directions change if a picture of the right eye is rectified as if it were
  // the left eye's; lenses and directions of two eyes differ by degrees before rectification. It is the best fit over
  // the whole picture. Zero for one camera, and if pictures pass through.
  const Vector3& eye_turn() const { return eye_turn_; }

  // Rectify `raw` into `out`, whose memory is reused if it has the right size and must not overlap `raw`. If
  // passes_through(), a caller may use `raw` itself instead. BAD_SIZE if the picture is not of the calibration's size;
  // NOT_STEREO from right() if the calibration is of one camera. After an error `out` is unchanged.
  Status left(ImageView raw, Image& out) const;
  Status right(ImageView raw, Image& out) const;

  // The same into a new picture.
  Result<Image> left(ImageView raw) const;
  Result<Image> right(ImageView raw) const;

 private:
  struct Maps;
  Rectifier() = default;
  Status apply(ImageView raw, int eye, Image& out) const;

  StereoCamera camera_;
  Matrix3 left_rotation_ = Matrix3::Identity();
  Vector3 eye_turn_ = Vector3::Zero();
  RawPixels left_pixels_{StereoCamera{}};
  std::shared_ptr<const Maps> maps_;
};

}  // namespace relmap::vision
