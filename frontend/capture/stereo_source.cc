#include "frontend/capture/stereo_source.h"

#include <utility>

namespace relmap::capture {

std::optional<StereoCalibration> StereoSource::raw_calibration() const {
  if (rectifier().passes_through()) return std::nullopt;
  StereoCalibration raw = calibration();
  if (raw.width == 0) raw.width = camera().width, raw.height = camera().height;
  return raw;
}

Result<StereoFrame> rectify(const vision::Rectifier& rectifier, StereoFrame raw) {
  if (rectifier.passes_through()) return raw;
  if (!raw.left.empty()) {
    auto left = rectifier.left(raw.left);
    if (!left.ok()) return left.status();
    raw.left = std::move(*left);
  }
  if (!raw.right.empty()) {
    auto right = rectifier.right(raw.right);
    if (!right.ok()) return right.status();
    raw.right = std::move(*right);
  }
  return raw;
}

}  // namespace relmap::capture
