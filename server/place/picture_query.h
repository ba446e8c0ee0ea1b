// Turns a picture into the features by which places are compared: decodes it within limits, reduces, rectifies and
// describes it.
#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "frontend/vision/rectify.h"
#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "proto/calibration/calibration.h"
#include "proto/geometry/camera.h"
#include "proto/keyframe/keyframe.h"
#include "storage/graph/frame.h"

namespace relmap::place {

// The calibration of the pictures as given: none, that of rectified pictures, or that of raw ones.
using PictureCalibration = std::variant<std::monostate, StereoCamera, StereoCalibration>;

// The camera of a session that took a picture, `left`: the raw one or, if the picture is said to be rectified or has
// the size that only rectified pictures have, the rectified one. Features, which have no picture, are of the rectified
// one. SESSION_DELETED, NO_CALIBRATION (the session was imported without a camera), BAD_SIZE (no picture of the session
// has this size), and the reasons of vision::picture_size().
Result<PictureCalibration> camera_of_session(const storage::Session& session, std::optional<ByteSpan> left,
                                             bool rectified);

// JPEG or PNG files; `right` may be empty.
struct PictureQuestion {
  ByteSpan left, right;
  PictureCalibration calibration;
};

// Tells where the picture as it was given shows what its features show: undoes rectification and reduction.
struct SentPixels {
  std::optional<vision::RawPixels> raw = {};  // nullopt: the picture was not rectified here
  double columns = 1, rows = 1;               // pixels of the reduced picture per pixel of the given one

  // Pixel (0, 0) is the centre of the top left pixel, of either picture.
  Vector2 of(const Vector2& pixel) const {
    const Vector2 reduced = raw ? raw->of(pixel) : pixel;
    return {(reduced.x() + 0.5) / columns - 0.5, (reduced.y() + 0.5) / rows - 0.5};
  }
};

struct DescribedPicture {
  std::vector<AppearanceFeature> features;  // in pixels of `camera`; with disparities if there is a right picture
  // The camera of the rectified and reduced picture. The baseline is 0 without a right picture or if that shows
  // nothing. Without a calibration, f is 0 and the principal point is the centre.
  StereoCamera camera;
  double scale = 1;                    // pixels of `camera` per pixel of the given picture
  Vector3 eye_turn = Vector3::Zero();  // Rectifier::eye_turn() if the picture was rectified here
  SentPixels sent = {};                // for pixels of the left picture
};

// Describes a picture or a stereo pair. Needs up to 120 MB while it runs, so the caller must let in one at a time.
// NOT_A_PICTURE, PICTURE_TOO_LARGE, PICTURE_DAMAGED, IMPLAUSIBLE_CALIBRATION, BAD_SIZE (picture and camera differ, or
// left and right), NOT_STEREO (a right picture that has no stereo calibration, equals the left one or is exchanged with
// it), EYE_DEAD (the left picture of a pair shows nothing), ROWS_APART (a pair of different times, or not rectified).
Result<DescribedPicture> describe_picture(const PictureQuestion& question);

}  // namespace relmap::place
