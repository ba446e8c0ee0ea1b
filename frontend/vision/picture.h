// Pictures from outside: JPEG and PNG bytes, decoded within limits (docs/protocol.md, RPC).
#pragma once

#include "frontend/vision/image.h"
#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "proto/calibration/calibration.h"
#include "proto/geometry/camera.h"

namespace relmap::vision {

inline constexpr std::size_t kMaxPictureBytes = 16u << 20;
inline constexpr double kMaxJpegMegapixels = 64;
inline constexpr double kMaxPngMegapixels = 8;
inline constexpr double kReducedPixels = 0.5e6;  // of questions, and of the frames of mono sessions

struct PictureSize {
  int width = 0, height = 0;
  bool png = false;
};
// From the header alone, nothing is decoded. NOT_A_PICTURE, PICTURE_DAMAGED, PICTURE_TOO_LARGE.
Result<PictureSize> picture_size(ByteSpan file);

struct DecodedPicture {
  Image grey;
  double scale = 1;  // pixels of `grey` per pixel of the file; scale a calibration by it
};
// Grey, reduced until it has at most `max_pixels` (0: as it is). Reasons as above, and
// UNSUPPORTED: a JPEG in CMYK.
Result<DecodedPicture> decode_picture(ByteSpan file, double max_pixels = kReducedPixels);

// By one factor in both directions, until it has at most `max_pixels` (0: as it is).
Image reduce(Image grey, double max_pixels);

// A camera, and a camera before rectification, of the same picture reduced to width x height. Pixel (0, 0) is the
// centre of the top left pixel.
StereoCamera reduced(const StereoCamera& camera, int width, int height);
StereoCalibration reduced(const StereoCalibration& calibration, int width, int height);

}  // namespace relmap::vision
