// Raw stereo pictures to those of a rectified StereoCamera.
#pragma once

#include <memory>

#include "frontend/vision/image.h"
#include "proto/base/status.h"
#include "proto/calibration/calibration.h"
#include "proto/geometry/camera.h"

namespace relmap::vision {

// Maps are made once; left() and right() may be called from several threads. Bouguet's rectification as OpenCV's
// stereoRectify does it, scaled so that every rectified pixel is seen, principal points at the same place in both
// pictures. Pictures that are rectified already pass through.
class Rectifier {
 public:
  // `width` and `height` are those of the pictures: they give the size that a calibration may lack, and must agree
  // with the one it has. IMPLAUSIBLE_CALIBRATION, BAD_SIZE.
  static Result<Rectifier> make(const StereoCalibration& calibration, int width, int height);

  const StereoCamera& camera() const { return camera_; }
  bool passes_through() const { return maps_ == nullptr; }
  // T_rectified_raw of the left eye: a rotation. Keyframe frames are rectified left cameras.
  const Matrix3& left_rotation() const { return left_rotation_; }
  // By how much directions change in a picture of the right eye that is rectified as the left one's: the rotation
  // (vector, radians) that fits best over the whole picture, since two eyes' lenses and directions differ by degrees
  // before they are rectified. Zero for one camera, and where pictures pass through.
  const Vector3& eye_turn() const { return eye_turn_; }

  // Into `out`, whose memory is used again if it is of that size; it must not be the memory of `raw`. A caller who owns
  // `raw` may take it as it is where passes_through(). BAD_SIZE if the picture is not of the calibration's size;
  // NOT_STEREO from right() if the calibration is of one camera. After an error `out` is as it was.
  Status left(ImageView raw, Image& out) const;
  Status right(ImageView raw, Image& out) const;

  // Into a new picture.
  Result<Image> left(ImageView raw) const;
  Result<Image> right(ImageView raw) const;

 private:
  struct Maps;
  Rectifier() = default;
  Status apply(ImageView raw, int eye, Image& out) const;

  StereoCamera camera_;
  Matrix3 left_rotation_ = Matrix3::Identity();
  Vector3 eye_turn_ = Vector3::Zero();
  std::shared_ptr<const Maps> maps_;
};

}  // namespace relmap::vision
