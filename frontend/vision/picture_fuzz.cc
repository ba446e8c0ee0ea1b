// Any bytes: the header is parsed, what declares at most 64 kilopixels is decoded, and a camera of that size is reduced
// with the picture.
#include <cmath>

#include "frontend/vision/picture.h"
#include "proto/base/testing/fuzzing.h"
#include "proto/calibration/calibration_samples.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace relmap;
  using namespace relmap::vision;
  using fuzzing::must;
  constexpr double kMaxDeclared = 65536, kMaxPixels = 4096;
  const ByteSpan file(data, size);
  const auto declared = picture_size(file);
  if (!declared.ok()) return 0;
  if (static_cast<double>(declared->width) * declared->height > kMaxDeclared) return 0;
  const auto picture = decode_picture(file, kMaxPixels);
  if (!picture.ok()) return 0;
  const int width = picture->grey.width(), height = picture->grey.height();
  must(!picture->grey.empty() && static_cast<double>(width) * height <= kMaxPixels);
  must(picture->scale > 0 && picture->scale <= 1);

  const StereoCamera declared_camera{500, 0.5 * declared->width, 0.5 * declared->height,
                                     0.1, declared->width,       declared->height};
  const StereoCamera camera = reduced(declared_camera, width, height);
  must(camera.width == width && camera.height == height && std::abs(camera.f - 500 * picture->scale) < 1e-6);
  StereoCalibration calibration = sample_raw_calibration();
  calibration.width = declared->width;
  calibration.height = declared->height;
  for (const bool one_eye : {false, true}) {
    if (one_eye) calibration.right = {};
    const StereoCalibration smaller = reduced(calibration, width, height);
    must(smaller.width == width && smaller.height == height && (smaller.right == RawCamera{}) == one_eye);
  }
  return 0;
}
