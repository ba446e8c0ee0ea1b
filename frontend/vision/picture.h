// Decodes untrusted JPEG and PNG files within limits (docs/protocol.md, RPC).
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
inline constexpr double kReducedPixels = 0.5e6;  // of localisation queries, and of the frames of mono sessions

struct PictureSize {
  int width = 0, height = 0;
  bool png = false;
};
// Reads the size from the header; nothing is decoded. NOT_A_PICTURE, PICTURE_DAMAGED, PICTURE_TOO_LARGE.
Result<PictureSize> picture_size(ByteSpan file);

struct DecodedPicture {
  Image grey;
  double scale = 1;  // width of `grey` / width in the file; scale a calibration by it
};
// Decodes to grey and reduces the picture to at most `max_pixels` (0: no limit). Reasons as of picture_size(), and
// UNSUPPORTED for a JPEG in CMYK.
Result<DecodedPicture> decode_picture(ByteSpan file, double max_pixels = kReducedPixels);

// Reduces a picture to at most `max_pixels`, by one factor in both directions (0: no limit).
Image reduce(Image grey, double max_pixels);

// The camera, or the calibration, of the same pictures reduced to width x height. Pixel (0, 0) is the centre of the top
// left pixel.
StereoCamera reduced(const StereoCamera& camera, int width, int height);
StereoCalibration reduced(const StereoCalibration& calibration, int width, int height);

}  // namespace relmap::vision
