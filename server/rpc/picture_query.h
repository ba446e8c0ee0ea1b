// From a picture to what places are compared by: decoded within limits, reduced, rectified, described.
#pragma once

#include <variant>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "proto/calibration/calibration.h"
#include "proto/geometry/camera.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::rpc {

// Of the pictures as given: none, rectified already, or not.
using PictureCalibration = std::variant<std::monostate, StereoCamera, StereoCalibration>;

// JPEG or PNG files; `right` may be empty.
struct PictureQuestion {
  ByteSpan left, right;
  PictureCalibration calibration;
};

struct DescribedPicture {
  std::vector<AppearanceFeature> features;  // in pixels of `camera`; disparities where a right picture gave them
  // Rectified and reduced; baseline 0 without a right picture, or with one that shows nothing; f 0 without a
  // calibration, and the principal point is the centre.
  StereoCamera camera;
  double scale = 1;                    // pixels of `camera` per pixel of the picture
  Vector3 eye_turn = Vector3::Zero();  // Rectifier::eye_turn(), of a picture that was rectified
};

// NOT_A_PICTURE, PICTURE_TOO_LARGE, PICTURE_DAMAGED, IMPLAUSIBLE_CALIBRATION, BAD_SIZE (picture and camera differ, or
// left and right), NOT_STEREO (a right picture without a stereo calibration, the same as the left one, exchanged with
// it), EYE_DEAD (of a pair the left one shows nothing), ROWS_APART (of another time, or not rectified). Needs up to 120
// MB for a moment: the caller lets in one at a time.
Result<DescribedPicture> describe_picture(const PictureQuestion& question);

}  // namespace relmap::rpc
