// The disparities at which the right picture is searched for a point of the left one.
#pragma once

#include <algorithm>

#include "frontend/vision/stereo_match.h"
#include "proto/geometry/camera.h"

namespace relmap::tracking {

// From `min_disparity`, in pixels, to that of the nearest depth, but at most to a fifth of the picture's width.
inline vision::StereoMatchOptions disparity_range(const StereoCamera& camera, float min_disparity) {
  constexpr double kMinDepth = 0.4;  // metres
  vision::StereoMatchOptions options;
  options.min_disparity = min_disparity;
  options.max_disparity = static_cast<float>(std::min(camera.f * camera.baseline / kMinDepth, 0.2 * camera.width));
  return options;
}

}  // namespace relmap::tracking
